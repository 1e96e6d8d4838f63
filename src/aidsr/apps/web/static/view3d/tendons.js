// Tendons, drawn as the straight pieces into which MuJoCo divides them, coloured by how hard they are pulled.
import {
  Color,
  CylinderGeometry,
  Group,
  InstancedMesh,
  Matrix4,
  MeshStandardMaterial,
  Quaternion,
  SphereGeometry,
  SRGBColorSpace,
  Vector3,
} from "./three/three.js";
import { tensionColour } from "./looks.js";

const NUMBERS = 8;
const ALONG = new Vector3(0, 0, 1);
const THINNEST = 0.0016; // of the robot's length: thinner ones would break up into dots on the screen

export class Tendons {
  constructor(facts) {
    this.facts = facts.tendons;
    this.thinnest = THINNEST * facts.length_m;
    this.group = new Group();
    this.byTension = true;
    this.lit = new Map();
    this.slack = new Color();
    this.own = this.facts.map((tendon) => new Color().setRGB(...tendon.rgba.slice(0, 3), SRGBColorSpace));
    this.colours = this.facts.map(() => new Color());
    this.segments = new Float32Array(0);
    this.tensions = new Float32Array(this.facts.length);
    this.material = new MeshStandardMaterial({ roughness: 0.42 });
    this.shapes = {
      piece: new CylinderGeometry(1, 1, 1, 10, 1, true).rotateX(Math.PI / 2),
      knot: new SphereGeometry(1, 10, 8),
    };
    this.reserve(64);
  }

  /** Show the pieces and tensions of a frame. */
  place(segments, tensions) {
    this.segments = segments;
    this.tensions = tensions;
    this.draw();
  }

  /** Colour tendons by name, over their tension; `colours` maps names to colours. */
  light(colours) {
    this.lit = colours;
    this.draw();
  }

  dispose() {
    for (const mesh of this.drawn) mesh.dispose();
    for (const shape of Object.values(this.shapes)) shape.dispose();
    this.material.dispose();
  }

  reserve(count) {
    for (const mesh of this.drawn ?? []) {
      this.group.remove(mesh);
      mesh.dispose();
    }
    this.room = count;
    this.drawn = [this.shapes.piece, this.shapes.knot].map((shape) => {
      const mesh = new InstancedMesh(shape, this.material, count);
      mesh.castShadow = mesh.receiveShadow = true;
      mesh.frustumCulled = false;
      this.group.add(mesh);
      return mesh;
    });
  }

  draw() {
    const count = this.segments.length / NUMBERS;
    if (count > this.room) this.reserve(2 * count);
    this.facts.forEach((tendon, index) => this.colour(tendon, index));
    const [pieces, knots] = this.drawn;
    const from = new Vector3();
    const to = new Vector3();
    const turn = new Quaternion();
    const size = new Vector3();
    const matrix = new Matrix4();
    for (let index = 0; index < count; index += 1) {
      const s = this.segments.subarray(NUMBERS * index, NUMBERS * index + NUMBERS);
      from.set(s[1], s[2], s[3]);
      to.set(s[4], s[5], s[6]);
      const radius = Math.max(s[7], this.thinnest);
      const length = to.distanceTo(from);
      knots.setMatrixAt(index, matrix.makeScale(radius, radius, radius).setPosition(from));
      turn.setFromUnitVectors(ALONG, to.sub(from).divideScalar(length || 1));
      from.addScaledVector(to, length / 2);
      pieces.setMatrixAt(index, matrix.compose(from, turn, size.set(radius, radius, length)));
      pieces.setColorAt(index, this.colours[s[0]]);
      knots.setColorAt(index, this.colours[s[0]]);
    }
    for (const mesh of this.drawn) {
      mesh.count = count;
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
  }

  colour(tendon, index) {
    const lit = this.lit.get(tendon.name);
    if (lit) this.colours[index].copy(lit);
    else if (this.byTension) tensionColour(this.tensions[index] / tendon.full_n, this.slack, this.colours[index]);
    else this.colours[index].copy(this.own[index]);
  }

  /** Return {tendon, depth} of the tendon drawn nearest to a point of the screen, or null beyond `reach` pixels. */
  at(point, project, reach) {
    let best = null;
    for (let at = 0; at < this.segments.length; at += NUMBERS) {
      const s = this.segments;
      const a = project(s[at + 1], s[at + 2], s[at + 3]);
      const b = project(s[at + 4], s[at + 5], s[at + 6]);
      const dx = b.x - a.x;
      const dy = b.y - a.y;
      const along = ((point.x - a.x) * dx + (point.y - a.y) * dy) / (dx * dx + dy * dy || 1);
      const share = Math.min(Math.max(along, 0), 1);
      const gap = Math.hypot(point.x - a.x - share * dx, point.y - a.y - share * dy);
      const depth = a.depth + share * (b.depth - a.depth);
      if (gap < reach && (!best || gap < best.gap)) best = { tendon: s[at], gap, depth };
    }
    return best;
  }
}
