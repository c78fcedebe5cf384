// The corners in groups, the ones that matter first: equal kinds, and amounts of the same class, are one row.

/** Classes of what rounded corners are off, for each tolerance, and of what sharp ones turn, for each right angle. */
const CLASSES = 10;
const TURNS = 9;
/** Corners of an open group that are in the document. */
const MOST_ROWS = 100;

class Corners extends List {
  /** @param {Meta} meta @param {Record<string, Values>} arrays @param {(place: Place, fly: boolean) => void} chosen */
  constructor(meta, arrays, chosen) {
    super(meta, arrays, Object.values(meta.corners?.counts ?? {}).reduce((sum, count) => sum + count, 0), "corner");
    this.chosen = chosen;
    /** @type {number[][]} corners of each group */
    this.groups = [];
    /** @type {number[]} the group of each corner */
    this.groupOf = [];
    /** @type {Set<number>} */
    this.open = new Set();
    const known = new Map();
    for (let i = 0; i < arrays.c_kind.length; i++) {
      const key = `${this.title(i)} ${this.class(i)}`;
      if (!known.has(key)) known.set(key, this.groups.push([]) - 1);
      this.groups[known.get(key)].push(i);
      this.groupOf.push(known.get(key));
    }
    this.draw();
  }

  get count() {
    return this.groupOf.length;
  }

  /** Class of the amount that corners of a kind are ordered by. @param {number} i */
  class(i) {
    if (this.arrays.c_kind[i] === 1) return Math.floor((this.turn(i) * TURNS) / 90);
    return Math.floor((this.off(i) * CLASSES) / this.meta.tolerance);
  }

  /** @param {number} i */
  turn(i) {
    const { c_turn: tip, c_axis_turn: top } = this.arrays;
    return tip[i] < 1 ? top[i] : tip[i];
  }

  /** @param {number} i */
  off(i) {
    return Math.max(this.arrays.c_off[i] || 0, this.arrays.c_axis_off[i] || 0);
  }

  draw() {
    const nodes = this.groups.flatMap((group, g) => {
      if (group.length === 1) return [this.row(group[0])];
      const open = this.open.has(g);
      if (!open) return [this.head(group, g)];
      const first = Math.min(Math.max(group.indexOf(this.selected) - MOST_ROWS / 2, 0), Math.max(group.length - MOST_ROWS, 0));
      return [this.head(group, g), ...group.slice(first, first + MOST_ROWS).map((i) => this.row(i))];
    });
    const counts = this.meta.corners?.counts ?? {};
    (this.meta.corners?.kinds ?? []).forEach((name, kind) => {
      const rest = (counts[name] ?? 0) - this.arrays.c_kind.filter((own) => own === kind).length;
      if (rest > 0) nodes.push(made("p", `and ${rest.toLocaleString("en")} more ${name}, which are off or turn less`));
    });
    if (counts.straight) nodes.push(made("p", `${counts.straight.toLocaleString("en")} more are straight`));
    this.list.replaceChildren(...nodes);
  }

  /** Row of a group. @param {number[]} group @param {number} g */
  head(group, g) {
    const turns = group.map((i) => this.turn(i));
    const [least, most] = [Math.min(...turns), Math.max(...turns)].map((turn) => turn.toFixed(0));
    const off = group.reduce((largest, i) => Math.max(largest, this.off(i)), 0);
    const turn = least === most ? `${most}°` : `${least}–${most}°`;
    const node = this.cells(group[0], this.title(group[0]), `${group.length.toLocaleString("en")} ×`, turn, `≤ ${offset(off)}`);
    node.classList.add("group");
    node.setAttribute("aria-expanded", String(this.open.has(g)));
    node.addEventListener("click", () => {
      if (!this.open.delete(g)) this.open.add(g);
      this.draw();
    });
    return node;
  }

  /** Row of a corner. @param {number} i */
  row(i) {
    const node = this.cells(i, this.title(i), String(this.arrays.c_line[i]), degrees(this.turn(i)), offset(this.off(i)));
    node.setAttribute("aria-pressed", String(i === this.selected));
    node.dataset.corner = String(i);
    node.addEventListener("click", () => this.select(i));
    return node;
  }

  /** @param {number} i @param {string} name @param {string[]} cells */
  cells(i, name, ...cells) {
    const node = made("button", "", "row");
    node.setAttribute("type", "button");
    const title = made("span");
    title.append(this.dot(i), name);
    node.append(title, ...cells.map((cell) => made("span", cell)));
    return node;
  }

  /** @param {number} i */
  dot(i) {
    const kind = this.arrays.c_kind[i];
    const dot = made("span", "", kind < 2 ? "dot sharp" : "dot");
    dot.style.background = KIND_COLOURS[kind];
    return dot;
  }

  /** @param {number} i */
  title(i) {
    const kind = this.arrays.c_kind[i];
    const reason = this.meta.corners?.reasons[this.arrays.c_reason[i]] ?? "";
    if (kind === 0) return "out of tolerance";
    return kind === 1 ? `sharp: ${reason}` : this.meta.corners?.kinds[kind] ?? "";
  }

  /** @param {number} i -1 for none @param {boolean} [fly] whether the view goes there */
  select(i, fly = true) {
    this.selected = i;
    if (i >= 0) {
      if (fly) this.open.add(this.groupOf[i]);
      const place = placeOf(this.arrays, "c", i);
      const head = made("h2");
      head.append(this.dot(i), made("span", `${i ? "" : "worst corner, "}${this.title(i)}`));
      this.fill(head, place, this.facts(i));
      this.chosen(place, fly);
    }
    this.draw();
  }

  /** What the panel says of a corner. @param {number} i @returns {[string, string][]} */
  facts(i) {
    const a = this.arrays;
    const limit = told(this.meta.tolerance);
    const place = [0, 1, 2].map((j) => (a.c_tip[3 * i + j] + this.meta.centre[j]).toFixed(4)).join("  ");
    return [
      ["lines", `${this.meta.origin} ${a.c_line[i]}${a.c_nc[i] ? `, NC ${a.c_nc[i]}` : ""}`],
      ["turn", `${degrees(a.c_turn[i])} at the tip, ${degrees(a.c_axis_turn[i])} at the axis point`],
      ["length", told(a.c_length[i], "mm")],
      ["off at tip", `${offset(a.c_off[i])} of ${limit} mm`],
      [`off at ${this.meta.axis_name}`, `${offset(a.c_axis_off[i])} of ${limit} mm`],
      ["place, mm", place],
    ];
  }
}
