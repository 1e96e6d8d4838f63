// A picture of a model in motion: camera, light, what lies under the pointer.
import {
  DirectionalLight,
  HemisphereLight,
  NeutralToneMapping,
  OrbitControls,
  PCFShadowMap,
  PerspectiveCamera,
  PMREMGenerator,
  Raycaster,
  RoomEnvironment,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "./three/three.js";
import { Bodies } from "./bodies.js";
import { Ghost, TARGET } from "./ghost.js";
import { Hands } from "./hands.js";
import { Floor } from "./floor.js";
import { CHOSEN, ERROR, THEMES, WARNING } from "./looks.js";
import { Rods } from "./rods.js";
import { Shapes } from "./shapes.js";
import { Tendons } from "./tendons.js";

const TENDON_REACH_PX = 7;
const CLICK_PX = 5;
const FULL_FORCE_LENGTHS = 0.8; // a contact as strong as a cable that pulls fully, as a share of the robot's length
const STEP_RAD = Math.PI / 24;
const WITHOUT_ROOM = 2.5; // of the sky's light instead, by eye as bright
const SOFTWARE_MS = 100; // between two pictures without a graphics card, for each view of the page: what draws them must keep up
const IN_SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

/** Return a name as a person reads it: assembly puts "robot/" before every name of the robot. */
export function shortName(name) {
  return name.replace(/^robot\//, "");
}

/** Whether this browser can draw in three dimensions at all. */
export function canDraw() {
  return graphics() !== null;
}

/** Return what draws in three dimensions, in its own words; null where nothing does. */
function graphics() {
  const context = document.createElement("canvas").getContext("webgl2");
  if (context === null) return null;
  const known = context.getExtension("WEBGL_debug_renderer_info");
  const name = context.getParameter(known ? known.UNMASKED_RENDERER_WEBGL : context.RENDERER);
  context.getExtension("WEBGL_lose_context")?.loseContext(); // browsers allow few at a time
  return String(name);
}

let views = 0;

export class Viewer {
  /**
   * @param {HTMLElement} host  which the picture fills
   * @param {{pick: (thing: object | null) => void, hover: (thing: object | null, event) => void,
   *          drawn: () => void, drag?, drop?, measured?}} listener  called with what was clicked, what the pointer is
   *   over, when all was redrawn; and as `Hands` does
   */
  constructor(host, listener) {
    this.host = host;
    this.listener = listener;
    this.renderer = new WebGLRenderer({ antialias: true, alpha: true, powerPreference: "high-performance" });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.toneMapping = NeutralToneMapping;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.canvas = this.renderer.domElement;
    host.append(this.canvas);
    this.camera = new PerspectiveCamera(35, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1); // before the controls, which take it over
    this.controls = new OrbitControls(this.camera, this.canvas);
    Object.assign(this.controls, { enableDamping: true, dampingFactor: 0.12, zoomToCursor: true });
    this.light();
    this.following = false;
    this.hands = new Hands(this, { drag() {}, drop() {}, measured() {}, ...listener });
    this.listen();
    this.resizing = new ResizeObserver(() => this.resize());
    this.resizing.observe(host);
    this.theming = new MutationObserver(() => this.dress());
    this.theming.observe(document.body, { attributes: true, attributeFilter: ["class"] });
    views += 1;
    this.renderer.setAnimationLoop(() => this.tick());
  }

  /** Show another model; the camera stays where a person put it as long as the model has the same size. */
  show(facts) {
    const stays = this.facts && Math.abs(this.facts.length_m / facts.length_m - 1) < 0.05;
    this.clear();
    this.facts = facts;
    this.moment = null;
    this.shapes = new Shapes(facts);
    this.tendons = new Tendons(facts);
    const lowest = Math.min(...facts.parts.map((part) => part.pose[2] - Math.max(...part.size.slice(0, 3), 0)), 0);
    this.floor = new Floor(facts.parts, facts.length_m, facts.camera.lookat, lowest);
    this.forces = new Rods("#e8590c", 0.004 * facts.length_m);
    this.bodies = new Bodies(facts);
    this.scene.add(this.shapes.group, this.tendons.group, this.floor.mesh, this.forces.group, this.bodies.group);
    this.hands.show(facts.length_m);
    this.setGhost(null);
    this.target = facts.target ? Ghost.of(facts.target, TARGET) : null;
    if (this.target) this.scene.add(this.target.group);
    this.controls.minDistance = 0.15 * facts.length_m;
    this.controls.maxDistance = 12 * facts.length_m;
    this.centre = null;
    this.dress();
    if (!stays) this.frame();
    this.glow();
  }

  /** Show a moment. */
  place(frame) {
    if (!this.shapes) return;
    this.shapes.place(frame.poses);
    this.tendons.place(frame.segments, frame.tensions);
    this.placeForces(frame.contacts);
    this.bodies.place(frame.poses);
    this.moment = frame;
    this.follow();
    this.dirty = true;
  }

  /** Draw the force on the robot at each contact; its length tells its size. */
  placeForces(contacts) {
    const scale = (FULL_FORCE_LENGTHS * this.facts.length_m) / (this.facts.tendons[0]?.full_n ?? 10);
    const rods = [];
    for (let at = 0; at < contacts.length; at += 6) {
      const from = new Vector3(contacts[at], contacts[at + 1], contacts[at + 2]);
      const force = new Vector3(contacts[at + 3], contacts[at + 4], contacts[at + 5]);
      rods.push([from, from.clone().addScaledVector(force, scale)]);
    }
    this.forces.place(rods);
  }

  /** Show a ghost in place of the one before: "now" for the robot as it stands, facts of another robot, or null for none. */
  setGhost(of) {
    if (this.ghost) {
      this.scene.remove(this.ghost.group);
      this.ghost.dispose();
    }
    const robot = () => this.shapes.meshes.filter((mesh) => mesh?.userData.part.robot && mesh.userData.part.kind === "geom");
    this.ghost = of === null ? null : of === "now" ? new Ghost(robot()) : Ghost.of(of);
    if (this.ghost) this.scene.add(this.ghost.group);
    this.dirty = true;
  }

  /** Put the camera where the robot is seen whole: as at first, or along a direction, by MuJoCo's angles. */
  frame({ azimuth_deg, elevation_deg } = this.facts.camera) {
    const { lookat, distance, fovy_deg } = this.facts.camera;
    const [azimuth, elevation] = [azimuth_deg, elevation_deg].map((angle) => (angle * Math.PI) / 180);
    const level = Math.cos(elevation);
    const forward = new Vector3(level * Math.cos(azimuth), level * Math.sin(azimuth), Math.sin(elevation));
    const narrow = Math.max(1, 1 / this.camera.aspect); // MuJoCo's distance fits the height
    this.camera.fov = fovy_deg;
    this.controls.target.set(...lookat);
    if (this.following && this.centre) this.controls.target.add(this.centre).sub(this.firstCentre);
    this.camera.position.copy(this.controls.target).addScaledVector(forward, -distance * narrow);
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.aim();
    this.dirty = true;
  }

  /** Turn the camera around the robot, or come nearer. */
  turn(sideways, upwards, nearer = 1) {
    const arm = this.camera.position.clone().sub(this.controls.target);
    const radius = arm.length() / nearer;
    const azimuth = Math.atan2(arm.y, arm.x) + sideways * STEP_RAD;
    const polar = Math.asin(arm.z / arm.length()) + upwards * STEP_RAD;
    const elevation = Math.min(Math.max(polar, -1.5), 1.5);
    const level = radius * Math.cos(elevation);
    arm.set(level * Math.cos(azimuth), level * Math.sin(azimuth), radius * Math.sin(elevation));
    this.camera.position.copy(this.controls.target).add(arm);
    this.controls.update();
    this.dirty = true;
  }

  /**
   * Return from where the robot is seen, as shares of the distance at which it is seen whole: the way from its middle to
   * the target, and on to the camera.
   */
  whence() {
    const target = this.controls.target.clone().sub(new Vector3(...this.facts.camera.lookat));
    const arm = this.camera.position.clone().sub(this.controls.target);
    return [target, arm].map((way) => way.divideScalar(this.facts.camera.distance));
  }

  /** Look from where another view does; see `whence`. */
  lookFrom([target, arm]) {
    const { lookat, distance } = this.facts.camera;
    this.controls.target.set(...lookat).addScaledVector(target, distance);
    this.camera.position.copy(this.controls.target).addScaledVector(arm, distance);
    this.controls.update();
    this.dirty = true;
  }

  /** Keep the robot in the middle while it moves, or not. */
  setFollowing(on) {
    this.following = on;
    this.centre = on ? this.robotCentre() : null;
  }

  /** Show where the goal wants things to be, or not. */
  setTarget(on) {
    if (this.target) this.target.group.visible = on;
    this.dirty = true;
  }

  /** Draw contact forces, and frames and inertia boxes of bodies, or not. */
  setDrawn({ forces, frames, inertia }) {
    if (!this.bodies) return;
    this.forces.group.visible = forces;
    this.bodies.frames.visible = frames;
    this.bodies.inertia.visible = inertia;
    if (this.moment) this.bodies.place(this.moment.poses);
    this.dirty = true;
  }

  setXray(on) {
    this.shapes?.xray(on);
    this.dirty = true;
  }

  setByTension(on) {
    if (!this.tendons) return;
    this.tendons.byTension = on;
    this.tendons.draw();
    this.dirty = true;
  }

  /** Let what faults name glow: `faults` are {names, severity}; `chosen` is what was clicked, {kind, name}, or null. */
  setLit(faults, chosen) {
    this.faults = faults;
    this.chosen = chosen;
    this.glow();
  }

  /** Return where on the canvas a body is [px], or null behind the camera. */
  spotOf(body) {
    const mesh = this.shapes?.meshes.find((one) => one?.userData.part.body === body);
    if (!mesh) return null;
    const e = mesh.matrix.elements;
    const spot = this.project(e[12], e[13], e[14]);
    return spot.depth > 0 ? spot : null;
  }

  /** Return the picture as a PNG blob, background and all. */
  async picture() {
    this.render();
    const flat = document.createElement("canvas");
    flat.width = this.canvas.width;
    flat.height = this.canvas.height;
    const draw = flat.getContext("2d");
    const sky = draw.createLinearGradient(0, 0, 0, flat.height);
    this.theme.sky.forEach((colour, index) => sky.addColorStop(index, colour));
    draw.fillStyle = sky;
    draw.fillRect(0, 0, flat.width, flat.height);
    draw.drawImage(this.canvas, 0, 0);
    return new Promise((resolve) => flat.toBlob(resolve, "image/png"));
  }

  /** Hand the picture to the person as a file. */
  async save(title) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(await this.picture());
    link.download = `${title.replace(/[^\w-]+/g, "_") || "robot"}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  dispose() {
    views -= 1;
    this.renderer.setAnimationLoop(null);
    this.resizing.disconnect();
    this.theming.disconnect();
    this.clear();
    this.controls.dispose();
    this.scene.environment?.dispose();
    this.renderer.dispose();
    this.canvas.remove();
  }

  clear() {
    if (this.facts) this.setGhost(null);
    this.hands.clear();
    for (const made of [this.shapes, this.tendons, this.floor, this.forces, this.bodies, this.target]) {
      if (made) this.scene.remove(made.group ?? made.mesh);
      made?.dispose();
    }
  }

  light() {
    this.scene = new Scene();
    // without a graphics card, light from all around a room takes longer to compute than all else until the first picture
    this.isFast = !IN_SOFTWARE.test(graphics());
    if (this.isFast) {
      const room = new PMREMGenerator(this.renderer);
      this.scene.environment = room.fromScene(new RoomEnvironment(), 0.04).texture;
      room.dispose();
    }
    this.hemisphere = new HemisphereLight();
    this.hemisphere.position.set(0, 0, 1);
    this.lamp = new DirectionalLight();
    this.lamp.castShadow = true;
    this.lamp.shadow.mapSize.set(2048, 2048);
    this.lamp.shadow.radius = 3.5;
    this.lamp.shadow.intensity = 0.7;
    this.scene.add(this.hemisphere, this.lamp, this.lamp.target);
  }

  /** Let the lamp shine over the viewer's left shoulder, with sharp shadows where the robot is. */
  aim() {
    const { distance } = this.facts.camera;
    const azimuth = (this.facts.camera.azimuth_deg * Math.PI) / 180 + Math.PI + 0.75;
    const away = new Vector3(0.62 * Math.cos(azimuth), 0.62 * Math.sin(azimuth), 1).multiplyScalar(1.5 * distance);
    this.lamp.target.position.copy(this.controls.target);
    this.lamp.position.copy(this.controls.target).add(away);
    const { camera } = this.lamp.shadow;
    const half = 0.75 * distance;
    Object.assign(camera, { left: -half, right: half, top: half, bottom: -half, near: 0.1 * distance, far: 4 * distance });
    camera.updateProjectionMatrix();
    this.lamp.shadow.normalBias = 0.0025 * distance;
    this.lamp.shadow.bias = -0.0002;
  }

  dress() {
    this.theme = THEMES[document.body.classList.contains("body--dark") ? "dark" : "light"];
    this.host.style.background = `linear-gradient(${this.theme.sky.join(",")})`;
    const [above, below, strength] = this.theme.hemisphere;
    this.hemisphere.color.set(above);
    this.hemisphere.groundColor.set(below);
    this.hemisphere.intensity = this.isFast ? strength : strength + WITHOUT_ROOM * this.theme.surround;
    this.lamp.color.set(this.theme.lamp[0]);
    this.lamp.intensity = this.theme.lamp[1];
    this.scene.environmentIntensity = this.theme.surround;
    this.floor?.dress(this.theme);
    this.tendons?.slack.set(this.theme.slack);
    this.tendons?.draw();
    this.dirty = true;
  }

  glow() {
    if (!this.facts) return;
    const bodies = new Map();
    const tendons = new Map();
    const add = (name, colour) => {
      for (const [kind, found] of this.facts.places[name] ?? this.facts.places[`robot/${name}`] ?? [])
        (kind === "body" ? bodies : tendons).set(found, colour);
    };
    const ranked = [...(this.faults ?? [])].sort((a, b) => (a.severity > b.severity ? -1 : 1)); // errors come last, on top
    for (const fault of ranked) for (const name of fault.names) add(name, fault.severity === "error" ? ERROR : WARNING);
    if (this.chosen) add(this.chosen.name, CHOSEN);
    this.shapes.light((body) => bodies.get(body));
    this.tendons.light(tendons);
    this.litBodies = [...bodies.keys()];
    this.dirty = true;
  }

  robotCentre() {
    const meshes = this.shapes?.moving.filter((mesh) => mesh?.userData.part.robot) ?? [];
    if (!meshes.length) return null;
    const centre = new Vector3();
    for (const mesh of meshes) centre.add(new Vector3().setFromMatrixPosition(mesh.matrix));
    return centre.divideScalar(meshes.length);
  }

  follow() {
    if (!this.following) return;
    const centre = this.robotCentre();
    this.firstCentre = this.centre ? this.firstCentre : centre?.clone();
    if (centre && this.centre) {
      const way = centre.clone().sub(this.centre);
      for (const moved of [this.camera.position, this.controls.target]) moved.add(way);
      for (const moved of [this.lamp.position, this.lamp.target.position]) moved.add(way);
      this.floor.follow(this.controls.target);
    }
    this.centre = centre;
  }

  listen() {
    let down = null;
    this.controls.addEventListener("change", () => (this.dirty = true));
    this.canvas.addEventListener("pointerdown", (event) => (down = [event.clientX, event.clientY]));
    this.canvas.addEventListener("pointerup", (event) => {
      const moved = down && Math.hypot(event.clientX - down[0], event.clientY - down[1]);
      down = null;
      const clicked = moved !== null && moved < CLICK_PX && event.button === 0;
      if (clicked && !this.hands.measuring) this.listener.pick(this.at(event));
    });
    this.canvas.addEventListener("pointermove", (event) => (this.pointer = event.buttons ? null : event));
    this.canvas.addEventListener("pointerleave", () => {
      this.pointer = null;
      this.listener.hover(null);
    });
    this.canvas.addEventListener("webglcontextrestored", () => (this.dirty = true));
  }

  /** Return {kind, name} of the body or tendon under a pointer event, or null. */
  at(event) {
    if (!this.shapes) return null;
    const box = this.canvas.getBoundingClientRect();
    const point = { x: event.clientX - box.left, y: event.clientY - box.top };
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2((2 * point.x) / box.width - 1, 1 - (2 * point.y) / box.height), this.camera);
    const seen = this.shapes.meshes.filter((mesh) => mesh && mesh.material.opacity > 0.3);
    const [hit] = ray.intersectObjects(seen, false);
    const project = (x, y, z) => this.project(x, y, z);
    const near = this.tendons.at(point, project, TENDON_REACH_PX);
    // a tendon lies on or just inside what it runs along
    const slack = 0.06 * this.facts.length_m;
    const hitDepth = hit ? hit.distance * ray.ray.direction.dot(this.camera.getWorldDirection(new Vector3())) : Infinity;
    if (near && near.depth < hitDepth + slack) return { kind: "tendon", name: this.facts.tendons[near.tendon].name };
    return hit ? { kind: "body", name: hit.object.userData.part.body } : null;
  }

  /** Return where on the canvas a point is [px], and its depth before the camera [m]. */
  project(x, y, z) {
    const point = new Vector3(x, y, z).applyMatrix4(this.camera.matrixWorldInverse);
    const depth = -point.z;
    point.applyMatrix4(this.camera.projectionMatrix);
    const { clientWidth, clientHeight } = this.canvas;
    return { x: ((point.x + 1) / 2) * clientWidth, y: ((1 - point.y) / 2) * clientHeight, depth };
  }

  resize() {
    const { clientWidth, clientHeight } = this.host;
    if (!clientWidth || !clientHeight) return;
    const before = Math.max(1, 1 / this.camera.aspect);
    this.renderer.setSize(clientWidth, clientHeight);
    this.camera.aspect = clientWidth / clientHeight;
    const after = Math.max(1, 1 / this.camera.aspect);
    const { target } = this.controls;
    this.camera.position.sub(target).multiplyScalar(after / before).add(target);
    this.camera.updateProjectionMatrix();
    this.render();
  }

  tick() {
    this.controls.update();
    if (this.pointer) {
      this.listener.hover(this.at(this.pointer), this.pointer);
      this.pointer = null;
    }
    const due = this.isFast || performance.now() - (this.drawnAt ?? 0) > SOFTWARE_MS * views;
    if (this.dirty && due) this.render();
  }

  render() {
    this.dirty = false;
    this.drawnAt = performance.now();
    const distance = this.camera.position.distanceTo(this.controls.target);
    this.camera.near = Math.max(0.02 * distance, 1e-4);
    this.camera.far = 4 * distance + 40 * (this.facts?.length_m ?? 1);
    this.camera.updateProjectionMatrix();
    this.renderer.render(this.scene, this.camera);
    this.listener.drawn();
  }
}
