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
    this.$el.on("plotly_relayout", (event) => this.turnOthers(event) || this.placeNotes(event));
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
      const { data, layout } = fitted(figure, this.$el.clientWidth, this.$el.clientHeight);
      return this.Plotly.react(this.$el, data, layout, config);
    },
    coloured(value) {
      if (typeof value === "string") return value.startsWith("@") ? this.colour(value) : value;
      if (Array.isArray(value)) return typeof value[0] === "number" ? value.slice() : value.map(this.coloured);
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
    // Words in a scene that was turned: none covers another one.
    placeNotes(event) {
      const camera = event?.["scene.camera"];
      const { scene } = this.$el.layout;
      if (!camera || !scene?.annotations?.length) return;
      const { _size, scene: { domain: { x } } } = this.$el._fullLayout;
      const notes = fitted.notes(scene, camera, _size.w * (x[1] - x[0]), _size.h, this.$el.data);
      this.Plotly.relayout(this.$el, { "scene.annotations": notes });
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
