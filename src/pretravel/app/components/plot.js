// A Plotly figure whose colours are names (@ink, @after~18), drawn in the colours of the page and
// drawn again when the reader changes between light and dark.
const EVENTS = ["plotly_click", "plotly_hover", "plotly_unhover", "plotly_relayout", "plotly_relayouting",
  "plotly_selected", "plotly_doubleclick", "plotly_afterplot"];

export default {
  template: "<div></div>",
  props: { options: Object, colours: Object },
  async mounted() {
    const { Plotly } = await import("nicegui-plotly");
    if (!this.options.data) return; // only loaded ahead
    this.Plotly = Plotly;
    await this.draw();
    this.$el.on("plotly_relayouting", (event) => this.turnOthers(event));
    this.$el.on("plotly_relayout", (event) => this.turnOthers(event));
    fitted.turnable(this.$el, Plotly);
    for (const name of EVENTS) this.$el.on(name, (event) => this.$emit(name, this.plain(event)));
    this.$watch(() => this.$q.dark.isActive, () => this.draw());
    // What is folded, or taken from the page at this moment, has no size: Plotly would refuse.
    this.observer = new ResizeObserver(() => {
      if (!this.$el.getClientRects().length) return;
      clearTimeout(this.waiting); // words and camera are those of its size
      this.waiting = setTimeout(() => this.$el.getClientRects().length && this.draw(), 100);
    });
    this.observer.observe(this.$el);
  },
  unmounted() {
    this.observer?.disconnect();
    this.Plotly?.purge(this.$el);
  },
  methods: {
    update() {
      if (this.Plotly) this.draw();
    },
    draw() {
      const { config, ...figure } = this.coloured(this.options);
      return fitted.drawn(this.$el, this.Plotly, figure, config);
    },
    coloured(value) {
      if (typeof value === "string") return value.startsWith("@") ? this.colour(value) : value;
      // Numbers alone have no colours; a step of a scale is a number with a colour.
      if (Array.isArray(value)) return value.length !== 2 && typeof value[0] === "number" ? value.slice() : value.map(this.coloured);
      if (value === null || typeof value !== "object") return value;
      return Object.fromEntries(Object.entries(value).map(([key, part]) => [key, this.coloured(part)]));
    },
    colour(name) {
      const [, word, percent] = name.match(/^@(\w+)(?:~(\d+))?$/) ?? [];
      const found = this.colours[this.$q.dark.isActive ? "dark" : "light"][word];
      if (!found || !percent) return found ?? name;
      const [red, green, blue] = [1, 3, 5].map((place) => parseInt(found.slice(place, place + 2), 16));
      return `rgba(${red},${green},${blue},${percent / 100})`;
    },
    // Scenes in a place "turned-together" have one camera: what the reader turns, the others follow.
    turnOthers(event) {
      const camera = event?.["scene.camera"];
      if (!camera) return;
      const seen = JSON.stringify(camera);
      for (const other of this.$el.closest(".turned-together")?.querySelectorAll(".js-plotly-plot") ?? []) {
        if (other === this.$el || JSON.stringify(other.layout?.scene?.camera) === seen) continue;
        this.Plotly.relayout(other, { "scene.camera": camera });
      }
    },
    // What the server needs of an event: elements of the page cannot be sent.
    plain(event) {
      const points = event?.points?.map((p) => ({
        curveNumber: p.curveNumber, pointNumber: p.pointNumber, customdata: p.customdata, x: p.x, y: p.y, z: p.z,
      }));
      if (points) return { points };
      return Object.fromEntries(Object.entries(event ?? {}).filter(([, part]) => typeof part !== "object" || Array.isArray(part)));
    },
  },
};
