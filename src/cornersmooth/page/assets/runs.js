// The runs of a filtered program: which were smoothed, what each is off and gains, and what was left as it is.

/** @typedef {{first: number, last: number, nc_first: number, nc_last: number, way: number[], off: number, before: number | null, after: number | null}} Run */

class Runs extends List {
  /** @param {Meta} meta @param {Record<string, Values>} arrays @param {(place: Place, run: Run, fly: boolean) => void} chosen */
  constructor(meta, arrays, chosen) {
    const runs = meta.runs ?? [];
    super(meta, arrays, runs.length, "run");
    this.chosen = chosen;
    this.runs = runs;
    const box = element("corners");
    box.classList.add("runs");
    box.setAttribute("aria-label", "Runs that were smoothed");
    box.querySelector("h2").append(" smoothed");
    const timed = this.runs.some((run) => gainOf(run) !== null);
    ["old lines", "blocks", "off, mm", timed ? "saves" : ""].forEach((text, k) => (box.querySelector(".head").children[k].textContent = text));
    this.draw();
  }

  get count() {
    return this.runs.length;
  }

  draw() {
    const nodes = this.runs.map((run, k) => {
      const gain = gainOf(run);
      const blocks = `${grouped(run.last - run.first + 1)} → ${grouped(run.nc_last - run.nc_first + 1)}`;
      const node = made("button", "", "row");
      node.setAttribute("type", "button");
      node.setAttribute("aria-pressed", String(k === this.selected));
      for (const text of [`${run.first}–${run.last}`, blocks, offset(run.off), gain === null ? "" : told(gain, "s", 3)]) node.append(made("span", text));
      node.addEventListener("click", () => this.select(k));
      return node;
    });
    const left = this.meta.left ?? [];
    if (left.length) nodes.push(made("h2", "Left as it is"));
    for (const { count, line, reason } of left) nodes.push(made("p", `${grouped(count)} ${count === 1 ? "cut" : "cuts"}, first in line ${line}: ${reason}`));
    this.list.replaceChildren(...nodes);
  }

  /** @param {number} k -1 for none @param {boolean} [fly] whether the view goes there */
  select(k, fly = true) {
    this.selected = k;
    const run = this.runs[k];
    if (run) {
      const place = placeOf(this.arrays, "w", worstOf(this.arrays, run));
      const gain = gainOf(run);
      /** @type {[string, string][]} */
      const rows = [
        ["old lines", `${run.first} to ${run.last}`],
        ["new lines", `${run.nc_first} to ${run.nc_last}`],
        ["off, largest", `${offset(run.off)} of ${told(this.meta.tolerance)} mm`],
        ...(gain === null ? [] : /** @type {[string, string][]} */ ([["time", `${told(run.after ?? NaN, "s", 4)} instead of ${told(run.before ?? NaN, "s", 4)}: ${gain < 0 ? "takes" : "saves"} ${told(Math.abs(gain), "s")}${gain < 0 ? " more" : ""}`]])),
      ];
      this.fill(made("h2", `run ${k + 1}, where it is off most`), place, rows);
      this.chosen(place, run, fly);
    }
    this.draw();
  }
}

/** Written point of a run that is off most. @param {Record<string, Values>} arrays @param {Run} run */
function worstOf({ w_nc: lines, w_off: off, w_axis_off: axisOff }, run) {
  let [best, most] = [0, -1];
  for (let i = 0; i < lines.length; i++) {
    const own = lines[i] >= run.nc_first && lines[i] <= run.nc_last ? Math.max(off[i] || 0, axisOff[i] || 0) : -1;
    if (own > most) [best, most] = [i, own];
  }
  return best;
}

/** Seconds that a run takes less than before, to the millisecond; null where that is not planned. @param {Run} run */
function gainOf({ before, after }) {
  return before === null || after === null ? null : Math.round(1000 * (before - after)) / 1000;
}
