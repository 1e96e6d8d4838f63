// The parts of an export as a Vue component for NiceGUI: each kind once, as it lies on the bed, with its letter.
import { canDraw, plate, squareInWords, Viewer } from "aidsr-view3d";

export default {
  template: `
<div v-if="!drawable" class="v3d-still"><p class="inside" role="status">The 3-D view needs WebGL, which this browser does not provide;
  the assembly sheet has a picture of the parts. Turn on hardware acceleration in the browser's settings, or open this page in another browser.</p></div>
<div v-else class="v3d v3d-bare" ref="root">
  <div class="v3d-stage">
    <div class="v3d-picture" ref="host" tabindex="0" role="application" :aria-label="'Parts of ' + title + '. ' + keys" @keydown="key"></div>
    <div class="v3d-labels" aria-hidden="true">
      <div v-for="label in labels" :key="label.text" class="v3d-label v3d-letter" :class="{'v3d-chosen': label.chosen}"
           :style="{transform: 'translate(' + label.x + 'px,' + label.y + 'px)'}">{{ label.text }}</div>
    </div>
    <div v-if="tip" class="v3d-tip" :style="{left: tip.x + 'px', top: tip.y + 'px'}">{{ tip.text }}</div>
    <div class="v3d-clock" v-if="chosen"><b>{{ chosen.letter }}</b> {{ chosen.about }}</div>
    <div class="v3d-tools" v-if="facts">
      <q-btn flat round dense size="sm" icon="center_focus_strong" @click="viewer.frame()" aria-label="Fit parts in view">
        <q-tooltip>Fit parts in view (F)</q-tooltip></q-btn>
      <q-btn flat round dense size="sm" icon="photo_camera" @click="viewer.save(title)" aria-label="Save a picture">
        <q-tooltip>Save a picture (P)</q-tooltip></q-btn>
    </div>
    <div class="v3d-square" v-if="facts">squares of {{ squareText }}</div>
    <div class="v3d-cover" v-if="cover"><q-spinner v-if="!trouble" size="2em" /><div>{{ cover }}</div></div>
  </div>
</div>`,

  props: { title: String, parts: Array },

  data() {
    return {
      drawable: canDraw(),
      facts: null,
      trouble: "",
      labels: [],
      tip: null,
      chosen: null,
      keys: "Arrows rotate, plus and minus zoom, F fits the parts in view, P saves a picture.",
    };
  },

  computed: {
    cover() {
      return this.trouble || (this.facts ? "" : "Loading the parts…");
    },
    squareText() {
      return squareInWords(this.facts.length_m);
    },
  },

  async mounted() {
    if (!this.drawable) return;
    this.viewer = new Viewer(this.$refs.host, {
      pick: (thing) => this.choose(thing?.name ?? ""),
      hover: (...at) => this.hover(...at),
      drawn: () => this.drawn(),
    });
    try {
      const facts = await plate(this.parts);
      if (!this.viewer) return; // the page was left meanwhile
      this.viewer.show(facts);
      this.facts = Object.freeze(facts);
    } catch (error) {
      this.trouble = `The parts could not be loaded: ${error.message}. Export the design again.`;
    }
  },

  unmounted() {
    this.viewer?.dispose();
    this.viewer = null;
  },

  methods: {
    choose(name) {
      this.chosen = this.parts.find((part) => part.name === name) ?? null;
      this.viewer?.setLit([], this.chosen);
      this.$refs.root?.scrollIntoView({ block: "nearest" });
    },
    hover(thing, event) {
      const part = thing && this.parts.find((one) => one.name === thing.name);
      this.viewer.canvas.style.cursor = part ? "pointer" : "grab";
      const box = this.$refs.host.getBoundingClientRect();
      this.tip = part ? { text: `${part.letter} ${part.about}`, x: event.clientX - box.left + 14, y: event.clientY - box.top + 14 } : null;
    },
    /** Put the letters where the parts are now; called after each picture. */
    drawn() {
      if (!this.viewer?.shapes) return;
      this.labels = this.parts.flatMap((part) => {
        const spot = this.viewer.spotOf(part.name);
        return spot ? [{ text: part.letter, chosen: part === this.chosen, x: spot.x, y: spot.y }] : [];
      });
    },
    key(event) {
      if (event.ctrlKey || event.metaKey || event.altKey || !this.facts) return;
      const does = {
        f: () => this.viewer.frame(),
        p: () => this.viewer.save(this.title),
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
  },
};
