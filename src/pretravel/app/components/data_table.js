// A table of texts with headings that sort it, a part of its rows at a time. Vue escapes the texts.
const ROWS = 25;

export default {
  template: `
    <div class="data-table" :class="form">
      <div class="table-frame" tabindex="0" role="region" :aria-label="label">
        <table class="sortable">
          <thead><tr>
            <th v-for="(heading, n) in headings" scope="col" :aria-sort="n === column ? order : null" :class="{number: numbers[n]}">
              <button type="button" @click="choose(n)">{{ heading }}</button>
            </th>
          </tr></thead>
          <tbody><tr v-for="row in shown">
            <td v-for="(cell, n) in row" :class="{number: numbers[n]}" :data-label="headings[n]">{{ cell }}</td>
          </tr></tbody>
        </table>
      </div>
      <nav v-if="pages > 1" class="table-pages" :aria-label="'Rows of ' + label">
        <button type="button" class="page-step" :disabled="page === 0" @click="page -= 1">Earlier</button>
        <span role="status">Rows {{ page * ${ROWS} + 1 }} to {{ Math.min((page + 1) * ${ROWS}, rows.length) }} of {{ rows.length }}</span>
        <button type="button" class="page-step" :disabled="page === pages - 1" @click="page += 1">Later</button>
      </nav>
    </div>`,
  props: { headings: Array, rows: Array, numbers: Array, label: String },
  data: () => ({ column: -1, order: "ascending", page: 0, form: "" }),
  watch: { rows() { this.page = 0; } },
  mounted() {
    this.observer = new ResizeObserver(() => this.fit());
    this.observer.observe(this.$el);
  },
  unmounted() {
    this.observer.disconnect();
  },
  computed: {
    pages() { return Math.ceil(this.rows.length / ROWS); },
    sorted() {
      if (this.column < 0) return this.rows;
      const number = (text) => (text === "" ? NaN : Number(text.replace("−", "-")));
      const sign = this.order === "ascending" ? 1 : -1;
      return [...this.rows].sort((one, other) => {
        const [a, b] = [one[this.column], other[this.column]];
        const [x, y] = [number(a), number(b)];
        if (isNaN(x) && isNaN(y)) return a.localeCompare(b) * sign;
        if (isNaN(x) || isNaN(y)) return isNaN(x) - isNaN(y); // empty cells stay at the end
        return (x - y) * sign;
      });
    },
    shown() { return this.sorted.slice(this.page * ROWS, (this.page + 1) * ROWS); },
  },
  methods: {
    // A table that is wider than its place has smaller letters; then each row is a list.
    async fit() {
      const frame = this.$el.querySelector(".table-frame");
      if (!frame.clientWidth || frame.clientWidth === this.width) return;
      this.width = frame.clientWidth;
      for (const form of ["", "dense", "dense stacked"]) {
        this.form = form;
        await this.$nextTick();
        if (frame.scrollWidth <= frame.clientWidth + 1) return;
      }
    },
    choose(n) {
      this.order = n === this.column && this.order === "ascending" ? "descending" : "ascending";
      this.column = n;
      this.page = 0;
    },
  },
};
