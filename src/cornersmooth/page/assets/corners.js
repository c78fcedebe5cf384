// The list of corners, the ones that matter first; only the rows in sight are in the document.

const ROW = 28;

class Corners {
  /** @param {Meta} meta @param {Record<string, Values>} arrays @param {(corner: number) => void} chosen */
  constructor(meta, arrays, chosen) {
    this.meta = meta;
    this.arrays = arrays;
    this.chosen = chosen;
    this.list = element("list");
    this.rows = element("rows");
    /** @type {number[]} */
    this.shown = [];
    this.selected = -1;
    this.filter = -1;
    this.buildFilters();
    this.apply();
    this.list.addEventListener("scroll", () => this.draw());
    new ResizeObserver(() => this.draw()).observe(this.list);
    this.list.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
      const step = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10 }[event.key];
      if (step === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      this.step(step);
    });
  }

  buildFilters() {
    const kinds = this.meta.corners?.kinds ?? [];
    const counts = this.meta.corners?.counts ?? {};
    const box = element("filters");
    /** @param {string} name @param {number} kind */
    const add = (name, kind) => {
      const button = made("button", name);
      button.setAttribute("type", "button");
      button.setAttribute("aria-pressed", String(kind === this.filter));
      button.addEventListener("click", () => {
        this.filter = kind;
        for (const other of box.children) other.setAttribute("aria-pressed", String(other === button));
        this.apply();
      });
      box.append(button);
    };
    add("all", -1);
    kinds.forEach((name, kind) => {
      if (counts[name]) add(`${name} ${counts[name].toLocaleString("en")}`, kind);
    });
  }

  apply() {
    const kind = this.arrays.c_kind;
    this.shown = [];
    for (let i = 0; i < kind.length; i++) if (this.filter < 0 || kind[i] === this.filter) this.shown.push(i);
    this.rows.style.height = `${this.shown.length * ROW}px`;
    this.list.scrollTop = 0;
    this.draw();
  }

  draw() {
    const first = Math.max(Math.floor(this.list.scrollTop / ROW) - 3, 0);
    const last = Math.min(first + Math.ceil(this.list.clientHeight / ROW) + 6, this.shown.length);
    const nodes = [];
    for (let k = first; k < last; k++) nodes.push(this.row(k));
    this.rows.replaceChildren(...nodes);
  }

  /** @param {number} k place in the list */
  row(k) {
    const i = this.shown[k];
    const { c_kind: kind, c_line: line, c_turn: tip, c_axis_turn: top, c_off: off, c_axis_off: axis } = this.arrays;
    const node = made("div", "", "row");
    node.setAttribute("role", "option");
    node.setAttribute("aria-selected", String(i === this.selected));
    node.dataset.corner = String(i);
    node.style.top = `${k * ROW}px`;
    const name = made("span");
    const dot = made("span", "", kind[i] < 2 ? "dot sharp" : "dot");
    dot.style.background = KIND_COLOURS[kind[i]];
    name.append(dot, this.title(i));
    const larger = Math.max(Number.isFinite(off[i]) ? off[i] : 0, Number.isFinite(axis[i]) ? axis[i] : 0);
    node.append(name, made("span", String(line[i])), made("span", degrees(tip[i] < 1 ? top[i] : tip[i])), made("span", offset(larger)));
    node.addEventListener("click", () => this.select(i));
    return node;
  }

  /** @param {number} i */
  title(i) {
    const kind = this.arrays.c_kind[i];
    const reason = this.meta.corners?.reasons[this.arrays.c_reason[i]] ?? "";
    if (kind === 0) return "out of tolerance";
    return kind === 1 ? `sharp: ${reason}` : this.meta.corners?.kinds[kind] ?? "";
  }

  /** @param {number} i */
  select(i) {
    this.selected = i;
    this.draw();
    this.fill(i);
    this.chosen(i);
  }

  /** The next corner of the list, or one farther on. @param {number} by */
  step(by) {
    if (!this.shown.length) return;
    const at = this.shown.indexOf(this.selected);
    const next = Math.min(Math.max(at < 0 ? 0 : at + by, 0), this.shown.length - 1);
    const top = next * ROW;
    if (top < this.list.scrollTop) this.list.scrollTop = top;
    else if (top + ROW > this.list.scrollTop + this.list.clientHeight) this.list.scrollTop = top + ROW - this.list.clientHeight;
    this.select(this.shown[next]);
  }

  /** @param {number} i */
  fill(i) {
    const a = this.arrays;
    const panel = element("panel");
    const head = made("h2");
    const dot = made("span", "", a.c_kind[i] < 2 ? "dot sharp" : "dot");
    dot.style.background = KIND_COLOURS[a.c_kind[i]];
    head.append(dot, made("span", this.title(i)));
    const facts = made("dl");
    const limit = told(this.meta.tolerance);
    const place = [0, 1, 2].map((j) => (a.c_tip[3 * i + j] + this.meta.centre[j]).toFixed(4)).join("  ");
    /** @type {[string, string][]} */
    const rows = [
      ["CL line", String(a.c_line[i])],
      ["NC line", a.c_nc[i] ? String(a.c_nc[i]) : "–"],
      ["turn", `${degrees(a.c_turn[i])} at the tip, ${degrees(a.c_axis_turn[i])} at the axis point`],
      ["length", told(a.c_length[i], "mm")],
      ["off at tip", `${offset(a.c_off[i])} of ${limit} mm`],
      ["off at axis point", `${offset(a.c_axis_off[i])} of ${limit} mm`],
      ["place, mm", place],
    ];
    for (const [label, value] of rows) facts.append(made("dt", label), made("dd", value));
    panel.replaceChildren(head, facts);
  }
}
