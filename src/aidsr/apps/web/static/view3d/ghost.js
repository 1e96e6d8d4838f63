// A robot that can be seen through: as it stood at another moment, or as another iteration has it.
import { Color, Group, Mesh, MeshStandardMaterial } from "./three/three.js";
import { Shapes } from "./shapes.js";

const OPACITY = 0.28;

export class Ghost {
  /** @param {Mesh[]} meshes  whose shapes and present places it takes */
  constructor(meshes) {
    this.group = new Group();
    this.material = new MeshStandardMaterial({ color: new Color("#8a6fd1"), transparent: true, opacity: OPACITY, depthWrite: false });
    for (const mesh of meshes) {
      const copy = new Mesh(mesh.geometry, this.material);
      copy.matrixAutoUpdate = false;
      copy.matrix.copy(mesh.matrix);
      this.group.add(copy);
    }
  }

  /** Return the ghost of another model's robot in its initial state; `facts` are {parts, surfaces, length_m}. */
  static of(facts) {
    const shapes = new Shapes(facts);
    const ghost = new Ghost(shapes.meshes.filter((mesh) => mesh));
    ghost.shapes = shapes;
    return ghost;
  }

  dispose() {
    this.shapes?.dispose();
    this.material.dispose();
  }
}
