// Tracks over time below a view: a cursor to drag, values under the pointer, events to jump to, and phases: when the robot touches something, when the goal holds.
const COLOURS = ["#1c87a6", "#d9822b", "#7a5cc2", "#2f9e5f", "#c9423a", "#8a7a00", "#c2569b", "#4c6ef5"];
const WIDTH = 1000;
const HEIGHT = 46;
const KEPT = "aidsr-hidden-tracks"; // names of tracks that a person has hidden, kept by the browser

export const Timeline = {
  template: `
<div class="v3d-timeline" ref="root" @pointermove="hover" @pointerleave="at = null" @pointerdown="grab" @pointerup="held = false">
  <div class="v3d-events"><button v-for="event in tracks.events" :key="event.label" type="button" @pointerdown.stop
    @click="$emit('seek', event.time_s)">{{ event.label }} <span>{{ event.time_s.toFixed(2) }} s</span></button>
    <span v-for="phase in phases" :key="phase.name" class="v3d-phase"><i :class="'v3d-' + phase.kind"></i>{{ phase.name }} {{ phase.share }}</span></div>
  <div v-for="track in drawn" :key="track.name" class="v3d-track">
    <div class="v3d-track-name"><button type="button" :aria-expanded="String(!track.hidden)" @pointerdown.stop @click="fold(track.name)"
      :title="track.hidden ? 'Show this track' : 'Hide this track'"><i>{{ track.hidden ? '▸' : '▾' }}</i><b>{{ track.name }}</b></button><span>{{ track.range }}</span>
      <template v-if="track.lines.length < 9"><span v-for="line in track.lines" :key="line.name" class="v3d-key">
        <i :style="{background: line.colour}"></i>{{ line.short }}<em>{{ line.value }}</em></span></template>
      <span v-else>{{ track.most }}</span></div>
    <svg v-if="!track.hidden" :viewBox="'0 0 ' + width + ' ' + height" preserveAspectRatio="none" role="img" :aria-label="track.name + ' over time'">
      <template v-for="phase in phases" :key="phase.name"><rect v-for="span in phase.spans" :key="span.x" :x="span.x" y="0"
        :width="span.width" :height="height" :class="'v3d-' + phase.kind" /></template>
      <polyline v-for="line in track.lines" :key="line.name" :points="line.points" :stroke="line.colour" fill="none"
        stroke-width="1.6" vector-effect="non-scaling-stroke" />
      <line v-for="event in marks" :x1="event" :x2="event" y1="0" :y2="height" class="v3d-mark" vector-effect="non-scaling-stroke" />
      <line :x1="cursor" :x2="cursor" y1="0" :y2="height" class="v3d-cursor" vector-effect="non-scaling-stroke" />
    </svg>
  </div>
</div>`,
  props: { tracks: Object, time: Number, duration: Number },
  emits: ["seek"],
  data: () => ({ at: null, held: false, width: WIDTH, height: HEIGHT, hidden: JSON.parse(localStorage.getItem(KEPT) ?? "[]") }),
  computed: {
    /** When the robot touches something and when the goal holds: a name, how long in all, and spans to shade. */
    phases() {
      return this.tracks.phases
        .filter((phase) => phase.spans.length)
        .map(({ name, spans }) => ({
          name,
          kind: name.replace(" ", "-"),
          share: `${spans.reduce((sum, [from, to]) => sum + to - from, 0).toFixed(2)} s`,
          spans: spans.map(([from, to]) => ({ x: this.x(from), width: Math.max(this.x(to) - this.x(from), 2) })),
        }));
    },
    marks() {
      return this.tracks.events.map((event) => this.x(event.time_s));
    },
    cursor() {
      return this.x(this.time);
    },
    row() {
      const time = this.at ?? this.time;
      const after = this.tracks.times.findIndex((each) => each >= time - 1e-6);
      return after < 0 ? this.tracks.times.length - 1 : after;
    },
    lines() {
      return this.tracks.tracks.map((track) => ({
        ...track,
        lines: track.lines.map((line, index) => ({
          ...line,
          colour: COLOURS[index % COLOURS.length],
          short: line.name.replace(/^robot\//, ""),
          points: line.values.map((value, at) => `${this.x(this.tracks.times[at]).toFixed(1)},${this.y(track, value)}`).join(" "),
        })),
      }));
    },
    drawn() {
      return this.lines.map((track) => {
        const lines = track.lines.map((line) => ({ ...line, value: this.number(line.values[this.row], track.unit) }));
        const most = track.lines.reduce((one, other) => (other.values[this.row] > one.values[this.row] ? other : one));
        return {
          ...track,
          lines,
          hidden: this.hidden.includes(track.name),
          range: `${this.number(track.low, "")} to ${this.number(track.high, track.unit)}`,
          most: `${lines.length} lines, current maximum ${this.number(most.values[this.row], track.unit)}, ${most.short}`,
        };
      });
    },
  },
  methods: {
    fold(name) {
      this.hidden = this.hidden.includes(name) ? this.hidden.filter((one) => one !== name) : [...this.hidden, name];
      localStorage.setItem(KEPT, JSON.stringify(this.hidden));
    },
    x(time) {
      return (WIDTH * time) / (this.duration || 1);
    },
    y(track, value) {
      return (HEIGHT - 2 - ((HEIGHT - 4) * (value - track.low)) / (track.high - track.low || 1)).toFixed(1);
    },
    number(value, unit) {
      const text = Math.abs(value) < 0.0005 ? "0" : Number(value.toPrecision(3)).toString();
      return unit ? `${text} ${unit}` : text;
    },
    timeOf(event) {
      const box = this.$refs.root.querySelector("svg")?.getBoundingClientRect();
      if (!box) return null;
      return (this.duration * Math.min(Math.max(event.clientX - box.left, 0), box.width)) / (box.width || 1);
    },
    hover(event) {
      this.at = this.held || event.target.closest("svg") ? this.timeOf(event) : null;
      if (this.held && this.at !== null) this.$emit("seek", this.at);
    },
    grab(event) {
      if (!event.target.closest("svg")) return;
      this.held = true;
      this.$emit("seek", this.timeOf(event));
    },
  },
};
