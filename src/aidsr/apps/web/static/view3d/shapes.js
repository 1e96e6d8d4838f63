// One three.js mesh for each shape of a model, as aidsr/apps/web/view3d/parts.py lists them.
import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CapsuleGeometry,
  Color,
  CylinderGeometry,
  DoubleSide,
  Group,
  Mesh,
  MeshStandardMaterial,
  PlaneGeometry,
  SphereGeometry,
  SRGBColorSpace,
  Vector3,
} from "./three/three.js";
import { isFloor } from "./floor.js";

const ONE = [1, 1, 1];
const XRAY_OPACITY = 0.16;
const ENDLESS = 14; // half side of a plane without end, in lengths of the robot; the floor reaches as far
const ENDLESS_OPACITY = 0.25; // it may stand between the robot and the camera

/** The shapes of a model. */
export class Shapes {
  constructor(facts) {
    this.group = new Group();
    this.unit = {
      sphere: new SphereGeometry(1, 36, 24),
      cylinder: new CylinderGeometry(1, 1, 2, 48).rotateX(Math.PI / 2),
      box: new BoxGeometry(2, 2, 2),
    };
    this.surfaces = facts.surfaces.map(surfaceGeometry);
    this.own = [];
    this.endless = ENDLESS * facts.length_m;
    const floor = facts.parts.find(isFloor);
    this.meshes = facts.parts.map((part) => (part === floor ? null : this.mesh(part)));
    this.moving = this.meshes.filter((_, index) => facts.parts[index].moves);
  }

  /** Set the poses of a frame; `poses` has 12 numbers for each shape. */
  place(poses) {
    this.moving.forEach((mesh, index) => mesh && setPose(mesh, poses.subarray(12 * index, 12 * index + 12)));
  }

  /** See through what is not the robot, or not. */
  xray(on) {
    for (const mesh of this.meshes) {
      if (!mesh || mesh.userData.part.robot) continue;
      const { alpha } = mesh.userData;
      setOpacity(mesh, on ? Math.min(alpha, XRAY_OPACITY) : alpha);
      mesh.castShadow = !on && alpha > 0.6;
    }
  }

  /** Let bodies glow; `colourOf` maps a body's name to a colour or undefined. */
  light(colourOf) {
    for (const mesh of this.meshes) {
      if (!mesh) continue;
      const colour = colourOf(mesh.userData.part.body);
      mesh.material.emissive.set(colour ?? 0x000000);
      mesh.material.emissiveIntensity = colour ? 0.55 : 0;
    }
  }

  dispose() {
    for (const geometry of [...Object.values(this.unit), ...this.surfaces, ...this.own]) geometry.dispose();
    for (const mesh of this.meshes) mesh?.material.dispose();
  }

  mesh(part) {
    const { geometry, scale } = this.geometry(part);
    const flat = part.surface !== undefined;
    const material = new MeshStandardMaterial({
      color: new Color().setRGB(...part.rgba.slice(0, 3), SRGBColorSpace),
      roughness: 0.72 - 0.3 * part.shine,
      metalness: 0,
      flatShading: flat,
    });
    if (flat || part.shape === "plane") material.side = DoubleSide;
    const mesh = new Mesh(geometry, material);
    mesh.matrixAutoUpdate = false;
    const endless = part.shape === "plane" && !(part.size[0] && part.size[1]);
    const alpha = endless ? Math.min(part.rgba[3], ENDLESS_OPACITY) : part.rgba[3];
    mesh.userData = { part, alpha, scale: new Vector3(...scale) };
    setPose(mesh, part.pose);
    setOpacity(mesh, alpha);
    mesh.castShadow = alpha > 0.6 && part.kind === "geom";
    mesh.receiveShadow = part.kind === "geom";
    this.group.add(mesh);
    return mesh;
  }

  /** Return the geometry of a part and by what to stretch it; sizes are half sizes, as MuJoCo has them. */
  geometry(part) {
    const [x, y, z] = part.size;
    if (part.surface !== undefined) return { geometry: this.surfaces[part.surface], scale: ONE };
    if (part.shape === "capsule") return { geometry: this.kept(new CapsuleGeometry(x, 2 * z, 10, 28)), scale: ONE };
    if (part.shape === "plane") {
      const [width, height] = [x, y].map((half) => 2 * (half || this.endless)); // 0 is a side without end
      return { geometry: this.kept(new PlaneGeometry(width, height), false), scale: ONE };
    }
    if (part.shape === "cylinder") return { geometry: this.unit.cylinder, scale: part.size };
    if (part.shape === "box") return { geometry: this.unit.box, scale: part.size };
    return { geometry: this.unit.sphere, scale: part.size };
  }

  kept(geometry, stand = true) {
    this.own.push(geometry);
    return stand ? geometry.rotateX(Math.PI / 2) : geometry; // three.js draws along y, MuJoCo along z
  }
}

function setPose(mesh, p) {
  mesh.matrix.set(p[3], p[4], p[5], p[0], p[6], p[7], p[8], p[1], p[9], p[10], p[11], p[2], 0, 0, 0, 1);
  mesh.matrix.scale(mesh.userData.scale);
  mesh.matrixWorldNeedsUpdate = true;
}

function setOpacity(mesh, alpha) {
  mesh.material.opacity = alpha;
  if (mesh.material.transparent !== alpha < 1) mesh.material.needsUpdate = true;
  mesh.material.transparent = alpha < 1;
  mesh.material.depthWrite = alpha > 0.6; // what can be seen through must not hide what is behind it
}

function surfaceGeometry(surface) {
  if (surface.isBufferGeometry) return surface;
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(surface.vertices), 3));
  geometry.setIndex(surface.triangles);
  geometry.computeVertexNormals();
  return geometry;
}
