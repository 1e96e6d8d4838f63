// Parts to print, side by side on a bed, given to the viewer as if they were the shapes of a model that stands still.
import { STLLoader, Vector3 } from "./three/three.js";

const MM = 0.001; // STL files of an export are in millimetres, pictures in metres
const APART = 0.012;
const FOV_DEG = 35;
const UPRIGHT = [1, 0, 0, 0, 1, 0, 0, 0, 1];

/**
 * Load parts and return what Viewer.show wants.
 * @param {{name: string, address: string, rgb: number[]}[]} parts
 */
export async function plate(parts) {
  const loader = new STLLoader();
  const surfaces = await Promise.all(parts.map(async ({ address }) => (await loader.loadAsync(address)).scale(MM, MM, MM).center()));
  const sizes = surfaces.map((surface) => {
    surface.computeBoundingBox();
    return surface.boundingBox.getSize(new Vector3());
  });
  const { places, wide, deep } = rows(sizes);
  const high = Math.max(...sizes.map((size) => size.z));
  const length = Math.max(wide, deep, high);
  const facts = parts.map((part, index) => ({
    ...still(part.name, [...part.rgb, 1], places[index]),
    shape: "mesh",
    size: sizes[index].toArray().map((side) => side / 2),
    surface: index,
  }));
  const bed = { ...still("", [1, 1, 1, 1], [wide / 2, deep / 2, 0]), shape: "plane", size: [0, 0, 0], robot: false };
  return {
    length_m: length,
    is_scene: false,
    parts: [...facts, bed],
    surfaces,
    tendons: [],
    places: Object.fromEntries(parts.map(({ name }) => [name, [["body", name]]])),
    camera: {
      lookat: [wide / 2, deep / 2, 0.3 * high],
      distance: (0.5 * Math.hypot(wide, deep, high)) / Math.sin((FOV_DEG * Math.PI) / 360),
      azimuth_deg: 75,
      elevation_deg: -38,
      fovy_deg: FOV_DEG,
    },
  };
}

/** Put boxes in rows, low ones before high ones; returns the middle of each, standing on the bed, and the sides of all. */
function rows(sizes) {
  const widest = Math.max(...sizes.map((size) => size.x));
  const limit = Math.max(widest, 1.4 * Math.sqrt(sizes.reduce((sum, size) => sum + (size.x + APART) * (size.y + APART), 0)));
  let [x, y, deepest, wide] = [0, 0, 0, 0];
  const places = new Array(sizes.length);
  const order = sizes.map((_, index) => index).sort((one, other) => sizes[one].z - sizes[other].z);
  for (const index of order) {
    const size = sizes[index];
    if (x > 0 && x + size.x > limit) [x, y, deepest] = [0, y + deepest + APART, 0];
    places[index] = [x + size.x / 2, y + size.y / 2, size.z / 2];
    x += size.x + APART;
    deepest = Math.max(deepest, size.y);
    wide = Math.max(wide, x - APART);
  }
  return { places, wide, deep: y + deepest };
}

function still(body, rgba, place) {
  return { kind: "geom", body, rgba, shine: 0.3, robot: true, moves: false, pose: [...place, ...UPRIGHT] };
}
