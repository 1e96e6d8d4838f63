// Straight rods with a knot at one end, as many as there are: contact forces, the spring by which a body is dragged, a measured distance.
import { Color, CylinderGeometry, Group, InstancedMesh, Matrix4, MeshStandardMaterial, Quaternion, SphereGeometry, Vector3 } from "./three/three.js";

const ALONG = new Vector3(0, 0, 1);

export class Rods {
  /**
   * @param {string} colour
   * @param {number} radius  of a rod [m]
   * @param {number} most    how many can be shown
   */
  constructor(colour, radius, most = 64) {
    this.group = new Group();
    this.radius = radius;
    this.most = most;
    this.material = new MeshStandardMaterial({ color: new Color(colour), roughness: 0.5, emissive: new Color(colour), emissiveIntensity: 0.35 });
    this.shapes = [new CylinderGeometry(1, 1, 1, 12, 1, true).rotateX(Math.PI / 2), new SphereGeometry(1, 14, 10)];
    this.meshes = this.shapes.map((shape) => new InstancedMesh(shape, this.material, most));
    for (const mesh of this.meshes) {
      mesh.frustumCulled = false;
      mesh.count = 0;
      this.group.add(mesh);
    }
  }

  /** Show these; each is [from, to], two Vector3. */
  place(rods) {
    const shown = rods.slice(0, this.most);
    const turn = new Quaternion();
    const matrix = new Matrix4();
    const way = new Vector3();
    const middle = new Vector3();
    const [rod, knot] = this.meshes;
    shown.forEach(([from, to], index) => {
      const length = way.copy(to).sub(from).length();
      turn.setFromUnitVectors(ALONG, way.divideScalar(length || 1));
      middle.copy(from).addScaledVector(way, length / 2);
      rod.setMatrixAt(index, matrix.compose(middle, turn, new Vector3(this.radius, this.radius, length || 1e-9)));
      const big = 2.2 * this.radius;
      knot.setMatrixAt(index, matrix.makeScale(big, big, big).setPosition(from));
    });
    for (const mesh of this.meshes) {
      mesh.count = shown.length;
      mesh.instanceMatrix.needsUpdate = true;
    }
  }

  dispose() {
    for (const mesh of this.meshes) mesh.dispose();
    for (const shape of this.shapes) shape.dispose();
    this.material.dispose();
  }
}
