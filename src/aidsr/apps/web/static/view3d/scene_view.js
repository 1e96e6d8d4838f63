// The view as a Vue component for NiceGUI: picture, transport, and a slider for each thing that can be pulled.
import { canDraw, Connection, FACTS, FRAME, shortName, squareInWords, STATE, TESTS, Timeline, TRACKS, Viewer } from "aidsr-view3d";

const SPEEDS = [0.05, 0.1, 0.25, 0.5, 1, 2];
const STEP_S = 0.01;
const SIDES = [
  { name: "Front, along −x", key: "1", azimuth_deg: 180, elevation_deg: 0 },
  { name: "Side, along −y", key: "2", azimuth_deg: -90, elevation_deg: 0 },
  { name: "Top, along −z", key: "3", azimuth_deg: 90, elevation_deg: -89.9 },
];
const DRAWN = [
  { key: "c", what: "forces", name: "Contact forces" },
  { key: "v", what: "byTension", name: "Tendon colour by tension", where: (facts) => facts.tendons.length },
  { key: "x", what: "xray", name: "Transparent environment", where: (facts) => facts.is_scene },
  { key: "e", what: "frames", name: "Body frames (x red, y green, z blue)" },
  { key: "i", what: "inertia", name: "Equivalent inertia boxes" },
];
const SEND_MS = 40;
const REPEAT_MS = 2000;
const HIDDEN_MS = 4000;
const LABELS_AT_MOST = 6;
const TOGETHER = new Set(); // views whose cameras turn together

export default {
  template: `
<figure v-if="!drawable" class="v3d-still">
  <img v-if="picture" :src="picture" :alt="title">
  <figcaption role="status">The interactive view needs WebGL, which this browser does not provide{{
    picture ? '; a still picture is shown instead' : '' }}. Turn on hardware acceleration in the browser's settings, or open
    this page in another browser.</figcaption>
</figure>
<div v-else class="v3d" :class="{'v3d-bare': !controls}" ref="root">
  <div class="v3d-stage">
    <div class="v3d-picture" ref="host" tabindex="0" role="application" :aria-label="'3-D view of ' + title + '. ' + keys"
         @keydown="key"></div>
    <div class="v3d-labels" aria-hidden="true">
      <div v-for="label in labels" :key="label.text" class="v3d-label" :class="'v3d-' + label.kind"
           :style="{transform: 'translate(' + label.x + 'px,' + label.y + 'px)'}">{{ label.text }}</div>
    </div>
    <div v-if="tip" class="v3d-tip" :style="{left: tip.x + 'px', top: tip.y + 'px'}">{{ tip.text }}</div>
    <div class="v3d-clock" v-if="facts"><b>{{ showing }}</b> {{ clock }}<span v-if="slow"> · {{ slow }}</span></div>
    <div class="v3d-tools" v-if="facts">
      <q-btn flat round dense size="sm" icon="center_focus_strong" @click="viewer.frame()" aria-label="Fit robot in view">
        <q-tooltip>Fit robot in view (F)</q-tooltip></q-btn>
      <q-btn flat round dense size="sm" icon="view_in_ar" aria-label="View direction"><q-tooltip>View direction (1, 2, 3)</q-tooltip>
        <q-menu><q-list dense><q-item v-for="side in sides" :key="side.key" clickable v-close-popup @click="viewer.frame(side)">
          <q-item-section>{{ side.name }} ({{ side.key }})</q-item-section></q-item></q-list></q-menu></q-btn>
      <q-btn flat round dense size="sm" icon="my_location" :color="following ? 'primary' : undefined" @click="toggle('following')"
        :aria-pressed="String(following)" aria-label="Follow the robot"><q-tooltip>Follow the robot</q-tooltip></q-btn>
      <q-btn flat round dense size="sm" icon="straighten" :color="measuring ? 'primary' : undefined" @click="measure"
        :aria-pressed="String(measuring)" aria-label="Measure between two points"><q-tooltip>Measure between two points (M)</q-tooltip></q-btn>
      <q-btn flat round dense size="sm" icon="control_camera" :color="ghost ? 'primary' : undefined" @click="toggleGhost"
        :aria-pressed="String(ghost)" :aria-label="ghostName"><q-tooltip>{{ ghostName }} (G)</q-tooltip></q-btn>
      <q-btn v-if="facts.target" flat round dense size="sm" icon="flag" :color="target ? 'primary' : undefined" @click="toggle('target')"
        :aria-pressed="String(target)" aria-label="Show the target"><q-tooltip>Show the target (T)</q-tooltip></q-btn>
      <q-btn flat round dense size="sm" icon="layers" aria-label="Display options"><q-tooltip>Display options</q-tooltip>
        <q-menu><q-list dense><q-item v-for="one in layers" :key="one.key" clickable @click="draw(one)" role="menuitemcheckbox"
          :aria-checked="String(drawing[one.what])"><q-item-section avatar>
          <q-icon :name="drawing[one.what] ? 'check_box' : 'check_box_outline_blank'" /></q-item-section>
          <q-item-section>{{ one.name }} ({{ one.key.toUpperCase() }})</q-item-section></q-item></q-list></q-menu></q-btn>
      <q-btn flat round dense size="sm" icon="photo_camera" @click="download" aria-label="Save a picture">
        <q-tooltip>Save a picture (P)</q-tooltip></q-btn>
      <q-btn flat round dense size="sm" icon="fullscreen" @click="fullScreen" aria-label="Full screen">
        <q-tooltip>Full screen</q-tooltip></q-btn>
    </div>
    <div class="v3d-measured" v-if="measuring">{{ distance === null ? 'Click two points' : distance }}</div>
    <div class="v3d-legend" v-if="facts && facts.tendons.length && !state.known">cable tension was not recorded</div>
    <div class="v3d-legend" v-else-if="facts && facts.tendons.length && drawing.byTension">
      <span>slack</span><i></i><span>{{ number(facts.tendons[0].full_n) }} N</span></div>
    <div class="v3d-square" v-if="facts">squares of {{ squareText }}</div>
    <div class="v3d-cover" v-if="cover"><q-spinner v-if="busy" size="2em" /><div>{{ cover }}</div>
      <q-btn v-if="status === 'open' && trouble" outline dense no-caps icon="replay" label="Reset" @click="send({do: 'reset'})" /></div>
  </div>
  <div class="v3d-transport" v-if="facts && controls">
    <q-btn flat round dense :icon="state.runs ? 'pause' : 'play_arrow'" @click="playPause"
      :aria-label="state.runs ? 'Pause' : 'Play'"><q-tooltip>{{ state.runs ? 'Pause' : 'Play' }} (space)</q-tooltip></q-btn>
    <q-btn flat round dense icon="replay" @click="send({do: 'reset'})" aria-label="Reset"><q-tooltip>Reset (R)</q-tooltip></q-btn>
    <q-btn-dropdown flat dense no-caps :label="state.speed + '×'" :aria-label="state.speed + '× real time'" class="v3d-speed">
      <q-list dense><q-item v-for="times in speeds" :key="times" clickable v-close-popup
        @click="send({do: 'speed', times})"><q-item-section>{{ times }}×</q-item-section></q-item></q-list>
    </q-btn-dropdown>
    <q-select class="v3d-choice" dense outlined options-dense emit-value map-options :options="choices" :model-value="choice"
      @update:model-value="choose" aria-label="Motion" />
    <q-btn v-if="state.mode === 'live'" flat dense no-caps size="sm" icon="timeline" label="Replay" @click="send({do: 'look_back'})">
      <q-tooltip>Replay the last minute of the simulation, with forces over time</q-tooltip></q-btn>
    <q-slider v-if="state.duration_s" class="v3d-seek" dense :min="0" :max="state.duration_s" :step="0.001" :model-value="time"
      @update:model-value="seek" aria-label="Time" />
  </div>
  <timeline v-if="tracked" :tracks="tracks" :time="time" :duration="state.duration_s" @seek="seek" />
  <div class="v3d-sliders" v-if="facts && controls && facts.controls.length && state.known">
    <template v-for="(part, number) in parts" :key="part.title">
    <div class="v3d-head"><b>{{ part.title }}</b>
      <q-btn v-if="!number" flat dense no-caps size="sm" label="Release" @click="letGo"><q-tooltip>Reset all commands to their rest values</q-tooltip></q-btn></div>
    <div v-for="row in part.rows" :key="row.key" class="v3d-row" :class="{'v3d-member': row.member, 'v3d-group': row.group}">
      <div class="v3d-name" :title="row.label">{{ row.label }}</div>
      <q-slider dense :min="0" :max="1" :step="0.005" :model-value="row.share" @update:model-value="pull(row, $event)"
        :aria-label="row.label" color="primary" />
      <div class="v3d-value">{{ row.value }}</div>
    </div>
    </template>
  </div>
</div>`,

  components: { Timeline },
  props: { view: String, path: String, title: String, picture: String, lit: Array, episodes: Array, controls: Boolean, together: Boolean },
  emits: ["pick", "ready"],

  data() {
    return {
      drawable: canDraw(),
      facts: null,
      state: { mode: "live", runs: true, speed: 1, trouble: "", duration_s: null, known: true },
      tests: [],
      status: "connecting",
      time: 0,
      pace: 1,
      ctrl: [],
      tensions: [],
      labels: [],
      tip: null,
      chosen: null,
      tracks: {},
      measuring: false,
      distance: null,
      ghost: false,
      target: true,
      following: false,
      speeds: SPEEDS,
      sides: SIDES,
      drawing: { forces: true, byTension: true, xray: false, frames: false, inertia: false },
      keys: "Space plays and pauses, comma and period step, R resets, Ctrl and the mouse drag a body, M measures, G shows a ghost, T shows the target, C, E and I show contact forces, body frames and inertia boxes, V colours tendons by tension, arrows rotate, plus and minus zoom, F fits the robot in view, 1, 2 and 3 show front, side and top, X makes the environment transparent, P saves a picture.",
    };
  },

  computed: {
    trouble() {
      return this.state.trouble;
    },
    busy() {
      return this.status !== "gone" && !this.trouble;
    },
    cover() {
      if (this.status === "gone") return "This view was closed. Reload the page.";
      if (this.status === "lost") return "Connection lost. Reconnecting…";
      if (this.trouble) return this.trouble;
      return this.facts ? "" : "Preparing the model…";
    },
    showing() {
      const { mode, index } = this.state;
      if (mode === "test") return `Test: ${this.tests[index] ?? ""}`;
      if (mode === "past") return "Your recording";
      return mode === "episode" ? `Episode: ${this.episodes[index] ?? ""}` : "Live";
    },
    clock() {
      return `${this.time.toFixed(2)} s`;
    },
    slow() {
      return this.state.runs && this.time > 0.5 && this.pace < 0.85 * this.state.speed ? `${this.pace.toFixed(2)}× real time` : "";
    },
    choice() {
      if (this.state.mode === "past") return "past";
      return this.state.mode === "live" ? "live" : `${this.state.mode} ${this.state.index}`;
    },
    choices() {
      return [
        { label: "Live simulation", value: "live" },
        ...(this.state.mode === "past" ? [{ label: "Your recording", value: "past" }] : []),
        ...this.tests.map((label, index) => ({ label: `Test: ${label}`, value: `test ${index}` })),
        ...this.episodes.map((label, index) => ({ label: `Episode: ${label}`, value: `episode ${index}` })),
      ];
    },
    tracked() {
      return this.controls && this.state.duration_s && this.tracks.tracks?.length;
    },
    ghostName() {
      return this.facts?.ghost ? "Show the previous iteration as a ghost" : "Show the current pose as a ghost";
    },
    layers() {
      return DRAWN.filter((one) => one.where?.(this.facts) ?? true);
    },
    parts() {
      const tendons = (row) => row.together.some((control) => control.pulls_tendon); // a group stays together
      return [
        { title: "Pull the tendons", rows: this.rows.filter(tendons) },
        { title: "Other actuators", rows: this.rows.filter((row) => !tendons(row)) },
      ].filter((part) => part.rows.length);
    },
    squareText() {
      return squareInWords(this.facts.length_m);
    },
    rows() {
      const controls = this.facts.controls;
      const grouped = new Map();
      const rows = [];
      for (const group of this.facts.groups) {
        const members = controls.filter((control) => group.members.includes(control.name));
        members.forEach((member) => grouped.set(member.name, true));
        rows.push(this.row(`group ${group.name}`, group.name, members, { group: true }));
        for (const member of members) rows.push(this.row(member.name, shortName(member.name), [member], { member: true, together: members }));
      }
      for (const control of controls)
        if (!grouped.has(control.name)) rows.push(this.row(control.name, shortName(control.name), [control], {}));
      return rows;
    },
  },

  watch: {
    lit: { deep: true, handler: "light" },
    following(on) {
      this.viewer.setFollowing(on);
    },
    target(on) {
      this.viewer.setTarget(on);
    },
    drawing: { deep: true, handler: "dress" },
    "state.known": "dress",
  },

  mounted() {
    if (!this.drawable) return;
    this.unsent = new Map();
    this.viewer = new Viewer(this.$refs.host, {
      pick: (thing) => this.pick(thing),
      hover: (...at) => this.hover(...at),
      drawn: () => this.drawn(),
      drag: (body, point, to) => this.send({ do: "drag", body, point, to }),
      drop: () => this.send({ do: "let_go" }),
      measured: (distance) => (this.distance = distance === null ? null : `${(1000 * distance).toPrecision(3)} mm`),
    });
    this.$refs.host.viewer = this.viewer; // for the console and the tests
    if (this.together) {
      TOGETHER.add(this);
      this.viewer.controls.addEventListener("change", () => this.turnOthers());
    }
    this.connection = new Connection(this.path, {
      message: (kind, value) => this.receive(kind, value),
      status: (status) => (this.status = status),
    });
    this.watching = new IntersectionObserver(([entry]) => {
      this.onScreen = entry.isIntersecting;
      this.lookOrNot();
    });
    this.watching.observe(this.$refs.root);
    this.lookOrNot = this.lookOrNot.bind(this);
    document.addEventListener("visibilitychange", this.lookOrNot);
  },

  unmounted() {
    if (!this.drawable) return;
    document.removeEventListener("visibilitychange", this.lookOrNot);
    clearTimeout(this.hiding);
    clearTimeout(this.sending);
    TOGETHER.delete(this);
    clearTimeout(this.repeating);
    this.watching.disconnect();
    this.connection.look(false);
    this.viewer.dispose();
  },

  methods: {
    lookOrNot() {
      clearTimeout(this.hiding);
      if (this.onScreen && !document.hidden) this.connection.look(true);
      else this.hiding = setTimeout(() => this.connection.look(false), HIDDEN_MS);
    },
    /** Let the other views of the page look from where this one does, each at its own robot. */
    turnOthers() {
      if (this.turned || !this.facts) return;
      for (const other of TOGETHER)
        if (other !== this && other.facts) {
          other.turned = true;
          other.viewer.lookFrom(this.viewer.whence());
          other.turned = false;
        }
    },
    receive(kind, value) {
      if (kind === FACTS) {
        const leader = this.together && !this.facts && [...TOGETHER].find((other) => other !== this && other.facts);
        this.turned = true; // a model that comes later leaves the views before it as they are
        this.facts = Object.freeze(value);
        this.viewer.show(value);
        if (leader) this.viewer.lookFrom(leader.viewer.whence());
        this.turned = false;
        this.following = value.is_free;
        this.viewer.setTarget(this.target);
        this.dress();
        this.ghost = this.measuring = false;
        this.light();
        this.$emit("ready");
      } else if (kind === FRAME) this.frame(value);
      else if (kind === STATE) {
        this.state = { ...this.state, ...value };
        if (!this.controls) this.repeat();
      }
      else if (kind === TRACKS) this.tracks = Object.freeze(value);
      else if (kind === TESTS) this.tests = value.tests;
    },
    /** Without controls, play the first episode again and again, unless the person wants no motion. */
    repeat() {
      clearTimeout(this.repeating);
      if (!this.episodes.length || matchMedia("(prefers-reduced-motion: reduce)").matches) return;
      if (this.state.mode === "live") this.send({ do: "episode", index: 0 });
      else if (!this.state.runs) this.repeating = setTimeout(() => this.send({ do: "play" }), REPEAT_MS);
    },
    frame(frame) {
      this.viewer.place(frame);
      this.time = frame.time;
      this.pace = frame.pace;
      this.tensions = frame.tensions;
      // what a person has just set stays where it was put until the player has received it
      this.ctrl = Array.from(frame.ctrl, (value, at) => this.unsent.get(at) ?? value);
    },
    send(command) {
      this.connection.send(command);
    },
    playPause() {
      this.send({ do: this.state.runs ? "pause" : "play" });
    },
    choose(value) {
      if (value === "past") return;
      const [mode, index] = value.split(" ");
      this.send(mode === "live" ? { do: "live" } : { do: mode, index: Number(index) });
    },
    replay(index, scroll = true) {
      if (!this.drawable) return;
      if (scroll) this.$refs.root.scrollIntoView({ block: "center" });
      this.connection.ask({ do: "episode", index });
    },
    seek(time) {
      this.time = time;
      this.send({ do: "pause" });
      this.send({ do: "seek", time_s: time });
    },
    row(key, label, members, more) {
      const shares = members.map((control) => (this.ctrl[control.at] - control.release) / (control.pull - control.release || 1));
      const share = Math.min(Math.max(shares.reduce((sum, one) => sum + one, 0) / shares.length || 0, 0), 1);
      return { key, label, members, share, value: this.amount(members, shares, share), together: members, ...more };
    },
    /** How hard cables are pulled where the robot rests, each at its own share; or the command itself with its unit. */
    amount(members, shares, share) {
      const [first] = members;
      if (members.every((control) => control.pulls_n.length)) {
        const pulls = members.map(({ pulls_n }, index) => {
          const at = Math.min(Math.max(shares[index] || 0, 0), 1) * (pulls_n.length - 1);
          const [low, high] = [Math.floor(at), Math.ceil(at)];
          return pulls_n[low] + (at - low) * (pulls_n[high] - pulls_n[low]);
        });
        const [least, most] = [Math.min(...pulls), Math.max(...pulls)].map((pull) => this.number(pull));
        return `${least === most ? most : `${least} to ${most}`} N`;
      }
      if (members.length > 1 || first.pulls_tendon) return `${Math.round(100 * share)} %`;
      return `${this.number(this.ctrl[first.at] ?? 0)} ${first.unit}`.trim();
    },
    pull(row, share) {
      for (const control of row.members) {
        const value = control.release + share * (control.pull - control.release);
        this.unsent.set(control.at, value);
        this.ctrl[control.at] = value;
      }
      this.sending ??= setTimeout(() => this.flush(), SEND_MS);
    },
    letGo() {
      for (const control of this.facts.controls) this.unsent.set(control.at, control.neutral);
      this.flush();
    },
    flush() {
      clearTimeout(this.sending);
      this.sending = null;
      this.send({ do: "ctrl", values: Object.fromEntries(this.unsent) });
      this.unsent.clear();
    },
    measure() {
      this.measuring = !this.measuring;
      this.viewer.hands.setMeasuring(this.measuring);
    },
    toggleGhost() {
      this.ghost = !this.ghost;
      this.viewer.setGhost(this.ghost ? (this.facts.ghost ?? "now") : null);
    },
    step(by) {
      if (this.state.duration_s) this.seek(Math.min(Math.max(this.time + by * STEP_S, 0), this.state.duration_s));
    },
    draw({ what }) {
      this.drawing[what] = !this.drawing[what];
    },
    dress() {
      this.viewer.setDrawn(this.drawing);
      this.viewer.setXray(this.drawing.xray);
      this.viewer.setByTension(this.drawing.byTension && this.state.known);
    },
    toggle(name) {
      this[name] = !this[name];
    },
    light() {
      this.viewer?.setLit(this.lit ?? [], this.chosen);
    },
    pick(thing) {
      this.chosen = thing;
      this.light();
      this.$refs.host.focus({ preventScroll: true });
      this.$emit("pick", thing ?? { kind: "", name: "" });
    },
    hover(thing, event) {
      this.viewer.canvas.style.cursor = thing ? "pointer" : "grab";
      if (!thing) {
        this.tip = null;
        return;
      }
      const box = this.$refs.host.getBoundingClientRect();
      this.tip = { text: this.tooltip(thing), x: event.clientX - box.left + 14, y: event.clientY - box.top + 14 };
    },
    tooltip(thing) {
      const index = this.facts.tendons.findIndex((tendon) => thing.kind === "tendon" && tendon.name === thing.name);
      const pulled = index < 0 ? "" : ` · ${this.number(this.tensions[index] ?? 0)} N`;
      const body = this.drawing.inertia && this.facts.bodies.find((one) => thing.kind === "body" && one.name === thing.name);
      return shortName(thing.name) + pulled + (body ? ` · ${this.number(1000 * body.mass_kg)} g` : "");
    },
    /** Put the labels of lit bodies where these are now; called after each picture. */
    drawn() {
      const named = new Map();
      for (const fault of this.lit ?? []) for (const name of fault.names) named.set(shortName(name), fault.severity);
      if (this.chosen?.kind === "body") named.set(shortName(this.chosen.name), "chosen");
      const labels = [];
      for (const body of this.viewer.litBodies ?? []) {
        const kind = named.get(shortName(body));
        const spot = kind && labels.length < LABELS_AT_MOST ? this.viewer.spotOf(body) : null;
        if (spot) labels.push({ text: shortName(body), kind, x: spot.x, y: spot.y });
      }
      this.labels = labels;
    },
    key(event) {
      if (event.ctrlKey || event.metaKey || event.altKey || !this.facts) return;
      const does = {
        " ": () => this.playPause(),
        r: () => this.send({ do: "reset" }),
        f: () => this.viewer.frame(),
        ...Object.fromEntries(SIDES.map((side) => [side.key, () => this.viewer.frame(side)])),
        m: () => this.measure(),
        g: () => this.toggleGhost(),
        t: () => this.facts.target && this.toggle("target"),
        ...Object.fromEntries(this.layers.map((one) => [one.key, () => this.draw(one)])),
        ",": () => this.step(-1),
        ".": () => this.step(1),
        p: () => this.download(),
        ArrowLeft: () => this.viewer.turn(-1, 0),
        ArrowRight: () => this.viewer.turn(1, 0),
        ArrowUp: () => this.viewer.turn(0, 1),
        ArrowDown: () => this.viewer.turn(0, -1),
        "+": () => this.viewer.turn(0, 0, 1.15),
        "-": () => this.viewer.turn(0, 0, 1 / 1.15),
      }[event.key.length === 1 ? event.key.toLowerCase() : event.key];
      if (!does) return;
      event.preventDefault();
      does();
    },
    download() {
      this.viewer.save(this.title);
    },
    fullScreen() {
      if (document.fullscreenElement) document.exitFullscreen();
      else this.$refs.root.requestFullscreen();
    },
    number(value) {
      return Math.abs(value) < 0.0005 ? "0" : Number(value.toPrecision(2)).toString();
    },
  },
};
