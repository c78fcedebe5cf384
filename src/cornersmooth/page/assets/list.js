// A list beside the view: keys and clicks select a row, and the panel shows what it is.

class List {
  /** @param {Meta} meta @param {Record<string, Values>} arrays @param {number} total @param {string} what */
  constructor(meta, arrays, total, what) {
    this.meta = meta;
    this.arrays = arrays;
    this.list = element("list");
    this.selected = -1;
    element("corners").querySelector("h2").textContent = `${total.toLocaleString("en")} ${total === 1 ? what : `${what}s`}`;
    this.list.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
      const step = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10 }[event.key];
      if (step === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      this.step(step);
    });
  }

  /** Rows that can be selected. @returns {number} */
  get count() {
    return 0;
  }

  /** @param {number} _row -1 for none @param {boolean} [_fly] whether the view goes there */
  select(_row, _fly) {}

  /** The next row in the order of what matters, or one farther on. @param {number} by */
  step(by) {
    if (!this.count) return;
    this.select(Math.min(Math.max(this.selected < 0 ? 0 : this.selected + by, 0), this.count - 1));
    this.list.querySelector("[aria-pressed=true]")?.scrollIntoView({ block: "nearest" });
  }

  /** Show the picture of a place and facts of it. @param {HTMLElement} head @param {Place} place @param {[string, string][]} rows */
  fill(head, place, rows) {
    const facts = made("dl");
    for (const [label, value] of rows) facts.append(made("dt", label), made("dd", value));
    element("panel").replaceChildren(head, insetOf(this.meta, this.arrays, place), facts);
  }
}
