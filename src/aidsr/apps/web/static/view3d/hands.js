// What the pointer does beside turning the picture: drag a body, as with Ctrl in MuJoCo's viewer, and measure between two points.
import { Raycaster, Vector2, Vector3 } from "./three/three.js";
import { Rods } from "./rods.js";

const SEND_MS = 40;

export class Hands {
  /**
   * @param {Viewer} viewer
   * @param {{drag: (body: string, point: number[], to: number[]) => void, drop: () => void, measured: (distance: number | null) => void}} listener
   */
  constructor(viewer, listener) {
    this.viewer = viewer;
    this.listener = listener;
    this.measuring = false;
    this.points = [];
    const { canvas } = viewer;
    canvas.addEventListener("pointerdown", (event) => this.down(event), true);
    canvas.addEventListener("pointermove", (event) => this.move(event), true);
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => this.up(event), true);
  }

  /** Begin again for another model. */
  show(length) {
    this.clear();
    this.spring = new Rods("#1f8fff", 0.004 * length, 1);
    this.ruler = new Rods("#d6409f", 0.003 * length, 2);
    this.viewer.scene.add(this.spring.group, this.ruler.group);
  }

  clear() {
    for (const rods of [this.spring, this.ruler])
      if (rods) {
        this.viewer.scene.remove(rods.group);
        rods.dispose();
      }
    this.setMeasuring(false);
  }

  setMeasuring(on) {
    this.measuring = on;
    this.points = [];
    this.ruler?.place([]);
    this.listener.measured(null);
    this.viewer.dirty = true;
  }

  down(event) {
    if (event.button !== 0) return;
    const hit = this.hit(event);
    if (this.measuring) {
      this.began = hit && [event.clientX, event.clientY, hit.point];
      return;
    }
    if (!(event.ctrlKey || event.metaKey) || !hit?.object.userData.part.moves) return;
    event.stopImmediatePropagation();
    this.viewer.controls.enabled = false;
    this.viewer.canvas.setPointerCapture(event.pointerId);
    this.held = { body: hit.object.userData.part.body, point: hit.point.clone(), sent: 0 };
  }

  move(event) {
    if (!this.held) return;
    event.stopImmediatePropagation();
    const to = this.onPlane(event, this.held.point);
    this.spring.place([[to, this.held.point]]);
    this.viewer.dirty = true;
    const now = performance.now();
    if (now - this.held.sent < SEND_MS) return;
    this.held.sent = now;
    this.listener.drag(this.held.body, this.held.point.toArray(), to.toArray());
  }

  up(event) {
    if (this.measuring && this.began) {
      const [x, y, point] = this.began;
      this.began = null;
      // the event goes on: what turns the camera must see that the button was let go
      if (Math.hypot(event.clientX - x, event.clientY - y) <= 5) this.measure(point.clone());
    }
    if (!this.held) return;
    event.stopImmediatePropagation();
    this.held = null;
    this.viewer.controls.enabled = true;
    this.spring.place([]);
    this.viewer.dirty = true;
    this.listener.drop();
  }

  measure(point) {
    this.points = this.points.length === 2 ? [point] : [...this.points, point];
    const [from, to] = this.points;
    this.ruler.place(to ? [[from, to], [to, from]] : [[from, from]]);
    this.listener.measured(to ? from.distanceTo(to) : null);
    this.viewer.dirty = true;
  }

  ray(event) {
    const box = this.viewer.canvas.getBoundingClientRect();
    const ray = new Raycaster();
    const x = (2 * (event.clientX - box.left)) / box.width - 1;
    const y = 1 - (2 * (event.clientY - box.top)) / box.height;
    ray.setFromCamera(new Vector2(x, y), this.viewer.camera);
    return ray;
  }

  hit(event) {
    const seen = this.viewer.shapes?.meshes.filter((mesh) => mesh && mesh.material.opacity > 0.3) ?? [];
    return this.ray(event).intersectObjects(seen, false)[0] ?? null;
  }

  /** Return where the pointer is in the plane through a point that faces the camera. */
  onPlane(event, point) {
    const { origin, direction } = this.ray(event).ray;
    const normal = this.viewer.camera.getWorldDirection(new Vector3());
    const far = point.clone().sub(origin).dot(normal) / direction.dot(normal);
    return origin.clone().addScaledVector(direction, far);
  }
}
