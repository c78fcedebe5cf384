// The slider, and the tool that it moves.

class Drive {
  /** @param {Meta} meta @param {Record<string, Values>} arrays @param {View} view */
  constructor(meta, arrays, view) {
    this.meta = meta;
    this.arrays = arrays;
    this.view = view;
    this.seconds = 0;
    this.running = false;
    /** @type {(seconds: number, way: number) => void} */
    this.moved = () => {};
    this.slider = element("slider");
    this.slider.addEventListener("input", () => this.set((Number(this.slider.value) / 10000) * meta.seconds, "slider"));
    element("play").addEventListener("click", () => this.play(!this.running));
  }

  /** @param {number} seconds @param {string} by who asks */
  set(seconds, by) {
    this.seconds = Math.min(Math.max(seconds || 0, 0), this.meta.seconds);
    if (by !== "slider") this.slider.value = String(this.meta.seconds ? (10000 * this.seconds) / this.meta.seconds : 0);
    if (by !== "clock" && this.running) this.play(false);
    this.update();
  }

  update() {
    const { w_time: time, w_tip: tip, w_axis: axis, w_way: way } = this.arrays;
    if (!time.length) return;
    const i = indexAt(time, this.seconds);
    const next = Math.min(i + 1, time.length - 1);
    const span = time[next] - time[i];
    const share = span > 0 ? (this.seconds - time[i]) / span : 0;
    const place = [0, 1, 2].map((j) => tip[3 * i + j] + share * (tip[3 * next + j] - tip[3 * i + j]));
    const lean = [0, 1, 2].map((j) => axis[3 * i + j] + share * (axis[3 * next + j] - axis[3 * i + j]));
    let shape = -1;
    this.meta.tools.forEach((tool, k) => {
      if (tool.from_second <= this.seconds) shape = k;
    });
    this.view.placeTool(Math.max(shape, 0), place, lean);
    const kind = this.meta.timed ? "" : " at programmed feed";
    element("clock").textContent = `${clock(this.seconds)} of ${clock(this.meta.seconds)}${kind}`;
    this.tellPlace(i);
    this.moved(this.seconds, way[i] + share * (way[next] - way[i]));
  }

  /** Says what is known of a written point. @param {number} i */
  tellPlace(i) {
    const a = this.arrays;
    if (i < 0) {
      element("place").textContent = "";
      return;
    }
    const speed = Number.isFinite(a.w_speed[i]) ? a.w_speed[i] : a.w_feed[i];
    const off = a.w_rapid[i] ? "rapid" : `off ${offset(a.w_off[i])} mm, ${this.meta.axis_name} ${offset(a.w_axis_off[i])} mm`;
    const pieces = [`${this.meta.origin} ${a.w_line[i]} · NC ${a.w_nc[i]}`, off, ...(Number.isFinite(speed) ? [told(speed, "mm/min", 4)] : [])];
    element("place").textContent = pieces.join(" · ");
  }

  /** @param {boolean} on */
  play(on) {
    this.running = on;
    const button = element("play");
    button.textContent = on ? "❚❚" : "▶";
    button.setAttribute("aria-label", on ? "Pause" : "Play");
    if (!on) return;
    if (this.seconds >= this.meta.seconds) this.set(0, "clock");
    let before = performance.now();
    const step = (/** @type {number} */ now) => {
      if (!this.running) return;
      this.set(this.seconds + (Math.max(now - before, 0) / 1000) * Number(element("pace").value), "clock");
      before = now;
      if (this.seconds >= this.meta.seconds) this.play(false);
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}
