// Charts below the view, on one scale: the way along the original path, or the planned time.

/** Pixels of a chart: a part of the height of the window, within bounds. */
const CHART_HEIGHT = { share: 0.21, least: 150, most: 280 };
/** Pixels of a row of charts up to which they are below each other. */
const ROW = 700;
const GAP = 10;

/** @typedef {{name: string, key: string, colour: string}} Series */
/** @typedef {{title: string, unit: string, digits: number, series: Series[], limit?: number, top?: number}} Chart one plot */
/** @typedef {{title: string, plots: Chart[]}} Row what is chosen: plots beside each other */

class Charts {
  /**
   * @param {Meta} meta @param {Record<string, Values>} arrays @param {HTMLElement} box
   * @param {{hover: (value: number | null) => void, go: (value: number) => void}} calls with a value on the scale
   */
  constructor(meta, arrays, box, calls) {
    this.meta = meta;
    this.arrays = arrays;
    this.box = box;
    this.calls = calls;
    /** @type {"way" | "time"} */
    this.scale = "way";
    /** @type {Plot[]} */
    this.plots = [];
    /** @type {[number, number] | null} the stretch that is looked at, on the scale; null for all */
    this.stretch = null;
    this.moving = false;
    this.paper = 0;
    /** @type {Plot | null} */
    this.pointed = null;
    this.select = element("chart");
    this.rows().forEach(({ title }, k) => {
      const option = /** @type {HTMLOptionElement} */ (made("option", title));
      option.value = String(k);
      this.select.append(option);
    });
    this.select.addEventListener("change", () => this.build());
    this.build();
    new ResizeObserver(() => this.resize()).observe(box);
  }

  /** What limits the cut comes first, else what changes most; the deviation where something is wrong. @returns {Row[]} */
  rows() {
    const { tolerance, axis_name: axisName, totals, badge } = this.meta;
    const { speeds, axes } = this.meta.charts;
    const both = speeds.length > 1;
    /** @type {Chart[]} */
    const saved = both ? [{ title: `seconds saved so far, of ${told(totals.direct, "s", 4)}`, unit: "", digits: 2, series: [{ name: "saved", key: "saved", colour: LAWS.written[1] }] }] : [];
    /** A plot for each motion, up to the same height. @param {string} title @param {string} key @param {string} unit @param {number} digits @param {number} [limit] @returns {Row} */
    const beside = (title, key, unit, digits, limit) => {
      const top = speeds.reduce((most, law) => largestOf(this.arrays[`${this.scale}_${key}_${law}`], most), 0) * 1.05;
      const plots = speeds.map((law) => {
        const [name, colour] = LAWS[law];
        return { title: `${title} ${name}, ${told(totals[law], "s", 4)}`, unit, digits, limit, top, series: [{ name, key: `${key}_${law}`, colour }] };
      });
      return { title, plots: [...plots, ...saved] };
    };
    const charts = axes.map((axis) => beside(`speed of ${axis}`, axis, "% of its limit", 1, 100));
    if (speeds.length) charts.push(beside("speed of the tip", "speed", "mm/min", 0));
    if (both) charts.push({ title: "time saved so far", plots: saved });
    const series = [{ name: axisName, key: "axis_off", colour: "#cc79a7" }, { name: "tip", key: "off", colour: "#0072b2" }];
    charts.push({ title: "deviation", plots: [{ title: "deviation", unit: "mm", digits: 4, series, limit: tolerance, top: 1.15 * tolerance }] });
    return badge === "FAILED" ? [...charts.splice(-1), ...charts] : charts;
  }

  /** Makes the charts that are chosen; on paper all of them. @param {number} [paper] pixels, 0 for the screen */
  build(paper = 0) {
    this.paper = paper;
    for (const plot of this.plots) plot.destroy();
    this.box.replaceChildren();
    const style = getComputedStyle(document.documentElement);
    const colours = Object.fromEntries(["soft", "line", "wash", "bad"].map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
    const rows = this.rows();
    /** @type {Set<string>} */
    const shown = new Set();
    this.plots = [];
    for (const row of paper ? rows : [rows[Number(this.select.value)]]) {
      const box = made("div", "", "row-of-charts");
      this.box.append(box);
      const plots = row.plots.filter(({ title }) => !shown.has(title));
      for (const chart of plots) {
        shown.add(chart.title);
        this.plots.push(this.plot(chart, box, colours));
      }
    }
    this.resize();
    if (this.stretch) this.look(...this.stretch);
  }

  /** @param {Chart} chart @param {HTMLElement} box @param {Record<string, string>} colours @returns {Plot} */
  plot(chart, box, { soft, line, wash, bad }) {
    const columns = chart.series.map(({ key }) => nulls(this.arrays[`${this.scale}_${key}`]));
    const axis = { stroke: soft, grid: { stroke: line, width: 1 }, ticks: { stroke: line, width: 1, size: 4 }, font: "11px system-ui, sans-serif" };
    const unit = this.scale === "way" ? "mm" : "s";
    const series = chart.series.map(({ name, colour }) => ({
      label: name, stroke: colour, width: 1.4, points: { show: false }, spanGaps: false, fill: chart.series.length > 1 ? undefined : `${colour}2b`,
      value: (/** @type {any} */ _, /** @type {number | null} */ value) => (value === null ? "–" : value.toFixed(chart.digits)),
    }));
    /** @type {any} */
    const options = {
      title: [chart.title, chart.unit].filter(Boolean).join(chart.title.includes(",") ? "; " : ", "),
      bands: chart.series.length > 1 ? [{ series: [1, 2], fill: wash }, { series: [2, 1], fill: wash }] : [],
      width: ROW,
      height: this.height(),
      cursor: { sync: { key: "cornersmooth" }, drag: { x: true, y: false, dist: 6 }, points: { size: 6 } },
      legend: { live: true },
      scales: { x: { time: false }, y: { range: (/** @type {any} */ _, /** @type {number} */ low, /** @type {number} */ high) => [Math.min(1.05 * (low ?? 0), 0), Math.max(1.05 * (high ?? 1), chart.top ?? 0)] } },
      series: [{ label: this.scale === "way" ? "path" : "time", value: (/** @type {any} */ _, /** @type {number | null} */ value) => (value === null ? "–" : `${grouped(value)} ${unit}`) }, ...series],
      axes: [{ ...axis, size: 26 }, { ...axis, size: 50 }],
      hooks: {
        draw: [(/** @type {any} */ plot) => drawLimit(plot, chart.limit, bad)],
        setCursor: [(/** @type {any} */ plot) => this.hover(plot)],
        setScale: [(/** @type {any} */ plot, /** @type {string} */ key) => this.follow(plot, key)],
      },
    };
    const plot = new uPlot(options, /** @type {any} */ ([this.arrays[`${this.scale}_x`], ...columns]), box);
    // only the chart under the pointer speaks: cursors are moved from outside, too
    plot.over.addEventListener("pointerenter", () => (this.pointed = plot));
    plot.over.addEventListener("pointerleave", () => {
      this.pointed = null;
      this.calls.hover(null);
    });
    plot.over.addEventListener("click", () => {
      const { left } = plot.cursor;
      if (left !== undefined && left >= 0 && !plot.select.width) this.calls.go(plot.posToVal(left, "x"));
    });
    return plot;
  }

  /** @param {"way" | "time"} scale */
  setScale(scale) {
    this.scale = scale;
    this.stretch = null;
    this.build();
  }

  /** Looks at a stretch of the scale. @param {number} min @param {number} max */
  look(min, max) {
    this.stretch = [min, max];
    this.plots[0]?.setScale("x", { min, max });
  }

  /** @param {Plot} plot */
  hover(plot) {
    const left = plot.cursor.left;
    if (left === undefined || plot !== this.pointed) return;
    this.calls.hover(left < 0 ? null : plot.posToVal(left, "x"));
  }

  /** All charts show the same stretch. @param {Plot} plot @param {string} key */
  follow(plot, key) {
    if (key !== "x" || this.moving) return;
    this.moving = true;
    const { min, max } = plot.scales.x;
    if (min !== undefined && max !== undefined && min !== null && max !== null && this.plots.includes(plot)) {
      const x = this.arrays[`${this.scale}_x`];
      this.stretch = min <= x[0] && max >= x[x.length - 1] ? null : [min, max];
      for (const other of this.plots) if (other !== plot) other.setScale("x", { min, max });
    }
    this.moving = false;
  }

  /** Puts the cursor of the charts somewhere without calling back. @param {number} value on the scale */
  mark(value) {
    // charts that were just made know their scales a moment later
    queueMicrotask(() => {
      for (const plot of this.plots) plot.setCursor({ left: plot.valToPos(value, "x"), top: 10 }, true);
    });
  }

  height() {
    const { share, least, most } = CHART_HEIGHT;
    return this.paper ? least : Math.min(Math.max(share * innerHeight, least), most);
  }

  /** Plots of a row share its width where there is enough. */
  resize() {
    const whole = this.paper || Math.max(this.box.clientWidth, 200);
    for (const row of this.box.children) {
      const own = this.plots.filter((plot) => plot.root.parentElement === row);
      const beside = this.paper ? Math.min(own.length, 2) : whole < ROW ? 1 : own.length;
      const width = Math.floor((whole - GAP * (beside - 1)) / beside);
      for (const plot of own) if (Math.abs(plot.width - width) > 1 || plot.height !== this.height()) plot.setSize({ width, height: this.height() });
    }
  }
}

/** @param {Values} values @param {number} most */
function largestOf(values, most) {
  for (const value of values) if (value > most) most = value;
  return most;
}

/** Gaps as null. @param {Values} values */
function nulls(values) {
  return Array.from(values, (value) => (Number.isFinite(value) ? value : null));
}

/** @param {Plot} plot @param {number | undefined} limit @param {string} colour */
function drawLimit(plot, limit, colour) {
  if (limit === undefined) return;
  const { ctx, bbox } = plot;
  const y = plot.valToPos(limit, "y", true);
  if (y < bbox.top) return;
  ctx.save();
  ctx.strokeStyle = colour;
  ctx.setLineDash([6, 4]);
  ctx.lineWidth = devicePixelRatio;
  ctx.beginPath();
  ctx.moveTo(bbox.left, y);
  ctx.lineTo(bbox.left + bbox.width, y);
  ctx.stroke();
  ctx.restore();
}
