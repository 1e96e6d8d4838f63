// Frames and inertia boxes of bodies, as aidsr/apps/web/view3d/bodies.py lists them; seen through all that is before them.
import { BoxGeometry, Color, Group, InstancedMesh, Matrix4, MeshStandardMaterial, Vector3 } from "./three/three.js";
import { Rods } from "./rods.js";

const AXES = ["#e03131", "#2f9e44", "#1c6fd6"]; // x, y, z, as in MuJoCo's viewer
const AXIS_LENGTHS = 0.08; // of the robot's length
const BOX = "#d6409f";

export class Bodies {
  constructor({ bodies = [], length_m }) {
    const most = Math.max(bodies.length, 1);
    this.bodies = bodies;
    this.length = AXIS_LENGTHS * length_m;
    this.axes = AXES.map((colour) => new Rods(colour, 0.0016 * length_m, most));
    this.frames = new Group();
    for (const rods of this.axes) this.frames.add(rods.group);
    this.box = new BoxGeometry(2, 2, 2);
    this.material = new MeshStandardMaterial({ color: new Color(BOX), transparent: true, opacity: 0.45, depthTest: false });
    this.inertia = new InstancedMesh(this.box, this.material, most);
    this.inertia.count = bodies.length;
    this.inertia.frustumCulled = false;
    this.frames.visible = this.inertia.visible = false;
    this.group = new Group();
    this.group.add(this.inertia, this.frames);
    this.inertia.renderOrder = 1;
    for (const mesh of this.axes.flatMap((rods) => rods.meshes)) {
      mesh.renderOrder = 2;
      mesh.material.depthTest = false;
      mesh.material.transparent = true; // drawn after what is solid
    }
  }

  /** Set the poses of a frame; `poses` has 12 numbers for each shape that moves. */
  place(poses) {
    if (!this.frames.visible && !this.inertia.visible) return;
    const rods = [[], [], []];
    this.bodies.forEach((body, index) => {
      const shape = matrixOf(poses.subarray(12 * body.part, 12 * body.part + 12));
      const frame = shape.clone().multiply(matrixOf(body.pose));
      const from = new Vector3().setFromMatrixPosition(frame);
      for (const axis of [0, 1, 2]) {
        const way = new Vector3().setFromMatrixColumn(frame, axis);
        rods[axis].push([from, from.clone().addScaledVector(way, this.length)]);
      }
      const box = shape.multiply(matrixOf(body.inertia.pose)).scale(new Vector3(...body.inertia.size));
      this.inertia.setMatrixAt(index, box);
    });
    this.axes.forEach((one, axis) => one.place(rods[axis]));
    this.inertia.instanceMatrix.needsUpdate = true;
  }

  dispose() {
    for (const rods of this.axes) rods.dispose();
    this.inertia.dispose();
    this.box.dispose();
    this.material.dispose();
  }
}

function matrixOf(p) {
  return new Matrix4().set(p[3], p[4], p[5], p[0], p[6], p[7], p[8], p[1], p[9], p[10], p[11], p[2], 0, 0, 0, 1);
}
