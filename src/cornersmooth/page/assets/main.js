// Puts the page together.

async function start() {
  const meta = readMeta();
  showHead(meta);
  const arrays = await readArrays(meta.arrays);
  const view = new View(meta, arrays, element("canvas"));
  const drive = new Drive(meta, arrays, view);
  const charts = new Charts(meta, arrays, element("plots"), {
    hover: (value) => {
      const i = value === null ? -1 : indexAt(arrays[charts.scale === "way" ? "w_way" : "w_time"], value);
      view.mark(i < 0 ? null : pointAt(arrays, i));
      if (i < 0) drive.update();
      else drive.tellPlace(i);
    },
    go: (value) => drive.set(charts.scale === "time" ? value : arrays.w_time[indexAt(arrays.w_way, value)], "chart"),
  });
  drive.moved = (seconds, way) => charts.mark(charts.scale === "time" ? seconds : way);
  const corners = meta.corners ? new Corners(meta, arrays, (i) => showCorner(i)) : null;
  if (!corners) element("side").hidden = true;
  else element("panel").append(made("p", cornerSentence(meta)));

  /** @param {number} i */
  function showCorner(i) {
    view.showCorner(i);
    drive.set(arrays.w_time[indexAt(arrays.w_way, arrays.c_way[i])], "corner");
  }

  const channels = channelsOf(meta, arrays);
  const select = element("channel");
  for (const [i, channel] of channels.entries()) {
    const option = /** @type {HTMLOptionElement} */ (made("option", channel.title));
    option.value = String(i);
    select.append(option);
  }
  const preferred = channels.findIndex((channel) => channel.key === "w_off");
  select.value = String(Math.max(preferred, 0));
  const recolour = () => {
    const channel = channels[Number(select.value)];
    if (!channel) return;
    view.setColours(coloursOf(channel));
    showLegend(channel, meta, Boolean(view.surface?.visible));
  };
  select.addEventListener("change", recolour);
  recolour();
  wireSwitches(view, recolour);
  wireKeys(view, drive, corners);
  wirePicking(view, drive, corners, arrays);
  for (const button of document.querySelectorAll("[data-scale]")) {
    button.addEventListener("click", () => {
      for (const other of document.querySelectorAll("[data-scale]")) other.setAttribute("aria-pressed", String(other === button));
      charts.setScale(/** @type {any} */ (button).dataset.scale);
      drive.update();
    });
  }
  const scheme = matchMedia("(prefers-color-scheme: dark)");
  scheme.addEventListener("change", () => {
    view.setScheme();
    charts.build();
  });
  view.setScheme();
  drive.set(arrays.w_time[Math.max(arrays.w_rapid.indexOf(0, 1), 0)] ?? 0, "start");
  view.mark(null);
  element("wait").hidden = true;
  // for tests and for the curious
  Object.assign(globalThis, { cornersmooth: { meta, arrays, view, charts, corners, drive, channels } });
  document.documentElement.dataset.ready = "true";
}

/** @param {Meta} meta */
function showHead(meta) {
  element("title").textContent = meta.title;
  element("verdict").textContent = meta.verdict;
  const badge = element("badge");
  badge.textContent = meta.kept === null ? "not verified" : meta.kept ? "kept" : "broken";
  if (meta.kept !== null) badge.classList.add(meta.kept ? "kept" : "broken");
  for (const [label, value] of meta.facts) element("facts").append(made("dt", label), made("dd", value));
  for (const note of meta.notes) element("notes").append(made("li", note));
}

/** @param {Meta} meta */
function cornerSentence(meta) {
  const counts = meta.corners?.counts ?? {};
  const total = Object.values(counts).reduce((sum, count) => sum + count, 0);
  return `${total.toLocaleString("en")} corners, ${(counts.straight ?? 0).toLocaleString("en")} of them straight. Choose one to go there; N and P step through the list.`;
}

/** @param {Record<string, Values>} arrays @param {number} i @returns {number[]} */
function pointAt(arrays, i) {
  return [arrays.w_tip[3 * i], arrays.w_tip[3 * i + 1], arrays.w_tip[3 * i + 2]];
}

/** The slider and the tool it moves. */
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
    element("clock").textContent = `${this.seconds.toFixed(2)} of ${this.meta.seconds.toFixed(2)} s${kind}`;
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
    const off = a.w_rapid[i] ? "rapid" : `off ${offset(a.w_off[i])} mm, axis point ${offset(a.w_axis_off[i])} mm`;
    element("place").textContent = `CL ${a.w_line[i]} · NC ${a.w_nc[i]}\n${off}` + (Number.isFinite(speed) ? `\n${told(speed, "mm/min", 4)}` : "");
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

/** @param {View} view @param {() => void} recolour */
function wireSwitches(view, recolour) {
  element("axes").addEventListener("change", (/** @type {any} */ event) => view.setAxes(event.target.value));
  element("fit").addEventListener("click", () => view.fit());
  /** @param {string} id @param {(on: boolean) => void} apply */
  const wire = (id, apply) => {
    const box = element(id);
    box.addEventListener("change", () => {
      apply(box.checked);
      view.touch();
    });
  };
  wire("show-original", (on) => (view.wanted.original = on));
  wire("show-written", (on) => (view.wanted.written = on));
  wire("show-rapids", (on) => (view.rapids.visible = on));
  wire("show-tool", (on) => (view.wanted.tool = on));
  if (view.surface) {
    const { surface } = view;
    element("surface-label").hidden = false;
    element("axes").value = "none";
    view.setAxes("none");
    wire("show-surface", (on) => {
      surface.visible = on;
      recolour();
    });
  }
}

/** @param {View} view @param {Drive} drive @param {Corners | null} corners */
function wireKeys(view, drive, corners) {
  document.addEventListener("keydown", (event) => {
    const field = /** @type {HTMLElement} */ (event.target).tagName;
    if (event.ctrlKey || event.metaKey || event.altKey || field === "SELECT" || field === "INPUT") return;
    const turn = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (turn && event.target === view.canvas) orbit(view, turn[0] * 0.12, turn[1] * 0.12, 1);
    else if (event.key === "+" || event.key === "=") orbit(view, 0, 0, 1 / 1.2);
    else if (event.key === "-") orbit(view, 0, 0, 1.2);
    else if (event.key === "f" || event.key === "F") view.fit();
    else if (event.key === "n" || event.key === "N") corners?.step(1);
    else if (event.key === "p" || event.key === "P") corners?.step(-1);
    else if (event.key === " " && field !== "BUTTON" && field !== "SUMMARY") drive.play(!drive.running);
    else return;
    event.preventDefault();
  });
}

/** @param {View} view @param {number} round @param {number} up @param {number} zoom */
function orbit(view, round, up, zoom) {
  const arm = view.camera.position.clone().sub(view.controls.target);
  const reach = arm.length() * zoom;
  const height = Math.min(Math.max(Math.acos(arm.z / arm.length()) + up, 0.02), Math.PI - 0.02);
  const heading = Math.atan2(arm.y, arm.x) + round;
  arm.set(Math.sin(height) * Math.cos(heading), Math.sin(height) * Math.sin(heading), Math.cos(height));
  view.camera.position.copy(view.controls.target).addScaledVector(arm, reach);
  view.touch();
}

/** @param {View} view @param {Drive} drive @param {Corners | null} corners @param {Record<string, Values>} arrays */
function wirePicking(view, drive, corners, arrays) {
  /** @type {[number, number] | null} */
  let pressed = null;
  view.canvas.addEventListener("pointerdown", (event) => (pressed = [event.offsetX, event.offsetY]));
  view.canvas.addEventListener("pointerup", (event) => {
    const moved = !pressed || Math.hypot(event.offsetX - pressed[0], event.offsetY - pressed[1]) > 4;
    if (moved) return;
    const found = view.pick(event.offsetX, event.offsetY);
    if (found && "corner" in found) corners?.select(found.corner);
    else if (found) drive.set(arrays.w_time[found.point], "view");
  });
}

start().catch((/** @type {Error} */ error) => {
  const wait = element("wait");
  wait.hidden = false;
  wait.textContent = `This browser cannot show the page: ${error.message}`;
  console.error(error);
});
