// Charts below the view, on one scale: the way along the original path, or the planned time.

const CHART_HEIGHT = 112;

/** @typedef {{title: string, unit: string, digits: number, series: {name: string, key: string, colour: string}[], limit?: number, top?: number}} Chart */

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
    this.moving = false;
    /** @type {Plot | null} */
    this.pointed = null;
    this.select = element("chart");
    this.kinds().forEach(({ title }, k) => {
      const option = /** @type {HTMLOptionElement} */ (made("option", title));
      option.value = String(k);
      this.select.append(option);
    });
    this.select.addEventListener("change", () => this.choose());
    this.build();
    new ResizeObserver(() => this.resize()).observe(box);
  }

  /** What smoothing changes most comes first; the deviation does where something is wrong. @returns {Chart[]} */
  kinds() {
    const { tolerance, totals, badge } = this.meta;
    const { speeds, axes } = this.meta.charts;
    /** @param {string} key */
    const laws = (key) => speeds.map((law) => ({ name: `${LAWS[law][0]}, ${told(totals[law], "s", 4)}`, key: `${key}_${law}`, colour: LAWS[law][1] }));
    /** @type {Chart[]} */
    const charts = axes.map((axis) => (
      { title: `speed of ${axis}`, unit: "% of its limit", digits: 1, series: laws(axis), limit: 100 }
    ));
    if (speeds.length) charts.push({ title: "speed of the tip", unit: "mm/min", digits: 0, series: laws("speed") });
    if (speeds.length > 1) charts.push({ title: "time saved so far", unit: "s", digits: 2, series: [{ name: "saved", key: "saved", colour: LAWS.written[1] }] });
    const offs = [{ name: "axis point", key: "axis_off", colour: "#cc79a7" }, { name: "tip", key: "off", colour: "#0072b2" }];
    charts.push({ title: "deviation", unit: "mm", digits: 4, series: offs, limit: tolerance, top: 1.15 * tolerance });
    return badge === "FAILED" ? [...charts.splice(-1), ...charts] : charts;
  }

  build() {
    for (const plot of this.plots) plot.destroy();
    this.box.replaceChildren();
    const style = getComputedStyle(document.documentElement);
    const text = style.getPropertyValue("--soft").trim();
    const line = style.getPropertyValue("--line").trim();
    const wash = style.getPropertyValue("--wash").trim();
    const bad = style.getPropertyValue("--bad").trim();
    const x = this.arrays[`${this.scale}_x`];
    this.plots = this.kinds().map((chart) => {
      const columns = chart.series.map(({ key }) => nulls(this.arrays[`${this.scale}_${key}`]));
      const axis = { stroke: text, grid: { stroke: line, width: 1 }, ticks: { stroke: line, width: 1, size: 4 }, font: "11px system-ui, sans-serif" };
      const unit = this.scale === "way" ? "mm" : "s";
      const series = chart.series.map(({ name, colour }) => ({
        label: name, stroke: colour, width: 1.4, points: { show: false }, spanGaps: false,
        value: (/** @type {any} */ _, /** @type {number | null} */ value) => (value === null ? "–" : value.toFixed(chart.digits)),
      }));
      /** @type {any} */
      const options = {
        title: `${chart.title}, ${chart.unit}`,
        bands: chart.series.length > 1 ? [{ series: [1, 2], fill: wash }, { series: [2, 1], fill: wash }] : [],
        width: Math.max(this.box.clientWidth, 200),
        height: CHART_HEIGHT,
        cursor: { sync: { key: "cornersmooth" }, drag: { x: true, y: false, dist: 6 }, points: { size: 6 } },
        legend: { live: true },
        scales: { x: { time: false }, y: { range: (/** @type {any} */ _, /** @type {number} */ low, /** @type {number} */ high) => [Math.min(1.05 * (low ?? 0), 0), Math.max(1.05 * (high ?? 1), chart.top ?? 0)] } },
        series: [{ label: this.scale === "way" ? "path" : "time", value: (/** @type {any} */ _, /** @type {number | null} */ value) => (value === null ? "–" : `${grouped(value)} ${unit}`) }, ...series],
        axes: [{ ...axis, size: 26 }, { ...axis, size: 58 }],
        hooks: {
          draw: [(/** @type {any} */ plot) => drawLimit(plot, chart.limit, bad)],
          setCursor: [(/** @type {any} */ plot) => this.hover(plot)],
          setScale: [(/** @type {any} */ plot, /** @type {string} */ key) => this.follow(plot, key)],
        },
      };
      const plot = new uPlot(options, /** @type {any} */ ([x, ...columns]), this.box);
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
    });
    this.choose();
  }

  /** Shows the chart that is chosen; paper has all of them. */
  choose() {
    this.plots.forEach((plot, k) => plot.root.classList.toggle("shown", k === Number(this.select.value)));
  }

  /** @param {"way" | "time"} scale */
  setScale(scale) {
    this.scale = scale;
    this.build();
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
    for (const other of this.plots) {
      if (other !== plot && min !== undefined && max !== undefined && min !== null && max !== null) other.setScale("x", { min, max });
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

  resize(width = Math.max(this.box.clientWidth, 200)) {
    for (const plot of this.plots) if (Math.abs(plot.width - width) > 1) plot.setSize({ width, height: CHART_HEIGHT });
  }
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
