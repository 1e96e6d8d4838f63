// The ground: a plane that fades into the background, with a grid for scale.
import { CircleGeometry, Color, DoubleSide, Mesh, MeshStandardMaterial } from "./three/three.js";

const UPRIGHT = 0.999;

/** Whether a shape is ground: MuJoCo's planes have no end, whatever size they are drawn with. */
export function isFloor(part) {
  return part.shape === "plane" && part.pose[11] > UPRIGHT;
}

/** Side of a square of the grid [m] that suits a robot of this length. */
export function gridSquare(length) {
  return 10 ** Math.floor(Math.log10(Math.max(length, 0.001) * 1.5)); // 10 cm for a robot of 7 to 67 cm
}

/** Return what a square of the grid measures, in words. */
export function squareInWords(length) {
  const square = gridSquare(length);
  return square >= 1 ? `${square} m` : square >= 0.01 ? `${Math.round(square * 100)} cm` : `${Math.round(square * 1000)} mm`;
}

/** The ground of a scene; without one, a grid alone hangs below it, so that there is something to judge motion by. */
export class Floor {
  /**
   * @param {object[]} parts   all shapes of the model
   * @param {number} length    of the robot [m]
   * @param {number[]} centre  of what is looked at [m]
   * @param {number} lowest    height of the lowest shape [m], where the grid hangs without a floor
   */
  constructor(parts, length, centre, lowest) {
    const plane = parts.find(isFloor);
    const square = gridSquare(length);
    this.solid = plane !== undefined;
    this.given = plane && !plane.rgba.every((number) => number > 0.99) ? new Color(...plane.rgba.slice(0, 3)) : null;
    this.uniforms = {
      lineColour: { value: new Color() },
      square: { value: square },
      centre: { value: [centre[0], centre[1]] },
      reach: { value: [5 * length, 14 * length] },
      solid: { value: this.solid ? 1 : 0 },
    };
    this.mesh = new Mesh(new CircleGeometry(14 * length, 96), this.material());
    this.mesh.position.set(centre[0], centre[1], plane ? plane.pose[2] : lowest - 0.02 * length);
    this.mesh.receiveShadow = this.solid;
    this.mesh.renderOrder = -1; // before all else that can be seen through
  }

  /** Put the middle of the visible ground below a point. */
  follow(point) {
    this.mesh.position.x = this.uniforms.centre.value[0] = point.x;
    this.mesh.position.y = this.uniforms.centre.value[1] = point.y;
  }

  dress(theme) {
    this.mesh.material.color.set(theme.floor);
    if (this.given) this.mesh.material.color.lerp(this.given, 0.35);
    this.uniforms.lineColour.value.set(theme.line);
  }

  dispose() {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }

  material() {
    const material = new MeshStandardMaterial({ roughness: 0.95, transparent: true, side: DoubleSide });
    material.polygonOffset = true; // boxes that lie in the ground's plane are seen, not flickered through
    material.polygonOffsetFactor = 1;
    material.polygonOffsetUnits = 2;
    material.depthWrite = this.solid;
    material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, this.uniforms);
      shader.vertexShader = `varying vec2 vGround;\n${shader.vertexShader}`.replace(
        "#include <fog_vertex>",
        "#include <fog_vertex>\n  vGround = (modelMatrix * vec4(transformed, 1.0)).xy;",
      );
      shader.fragmentShader = `varying vec2 vGround;
uniform vec3 lineColour; uniform float square; uniform vec2 centre; uniform vec2 reach; uniform float solid;
float grid(float side, float width) {
  vec2 at = vGround / side;
  vec2 pixel = fwidth(at);
  vec2 line = 1.0 - smoothstep(vec2(0.0), pixel * width, abs(fract(at - 0.5) - 0.5));
  return max(line.x, line.y) * (1.0 - smoothstep(0.15, 0.5, max(pixel.x, pixel.y)));
}
${shader.fragmentShader}`.replace(
        "#include <color_fragment>",
        `#include <color_fragment>
  float lines = max(0.45 * grid(square, 1.2), 0.9 * grid(10.0 * square, 1.6));
  diffuseColor.rgb = mix(diffuseColor.rgb, lineColour, lines);
  diffuseColor.a = mix(0.8 * lines, 1.0, solid) * (1.0 - smoothstep(reach.x, reach.y, distance(vGround, centre)));
  if (diffuseColor.a < 0.004) discard;`,
      );
    };
    return material;
  }
}
