// What can be seen through: a robot as it stood at another moment or as another iteration has it, and the target of a goal.
import { Color, Group, Mesh, MeshStandardMaterial } from "./three/three.js";
import { Shapes } from "./shapes.js";

const OPACITY = 0.28;
const ROBOT = "#8a6fd1";
export const TARGET = "#2f9e5f";

export class Ghost {
  /**
   * @param {Mesh[]} meshes  whose shapes and present places it takes
   * @param {string} colour
   */
  constructor(meshes, colour = ROBOT) {
    this.group = new Group();
    this.material = new MeshStandardMaterial({ color: new Color(colour), transparent: true, opacity: OPACITY, depthWrite: false });
    for (const mesh of meshes) {
      const copy = new Mesh(mesh.geometry, this.material);
      copy.matrixAutoUpdate = false;
      copy.matrix.copy(mesh.matrix);
      this.group.add(copy);
    }
  }

  /** Return the ghost of shapes as they are listed, such as another robot's; `facts` are {parts, surfaces, length_m}. */
  static of(facts, colour = ROBOT) {
    const shapes = new Shapes(facts);
    const ghost = new Ghost(shapes.meshes.filter((mesh) => mesh), colour);
    ghost.shapes = shapes;
    return ghost;
  }

  dispose() {
    this.shapes?.dispose();
    this.material.dispose();
  }
}
