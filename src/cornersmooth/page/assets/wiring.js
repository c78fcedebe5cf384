// Switches, keys, clicks and paper.

/** Pixels of a chart on paper: A4 and letter, upright. */
const PAPER = 640;

/** @param {View} view @param {() => void} recolour */
function wireSwitches(view, recolour) {
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
  wire("show-axes", (on) => (view.wanted.axes = on));
  wire("show-tool", (on) => (view.wanted.tool = on));
  if (view.surface) {
    const { surface } = view;
    element("surface-label").hidden = false;
    view.wanted.axes = element("show-axes").checked = false;
    wire("show-surface", (on) => {
      surface.visible = on;
      recolour();
    });
  }
}

/** @param {View} view @param {Drive} drive @param {Corners | Runs} corners */
function wireKeys(view, drive, corners) {
  document.addEventListener("keydown", (event) => {
    const field = /** @type {HTMLElement} */ (event.target).tagName;
    if (event.ctrlKey || event.metaKey || event.altKey || field === "SELECT" || field === "INPUT") return;
    const turn = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (turn && event.shiftKey && event.target === view.canvas) view.eye.pan(0.1 * turn[0], -0.1 * turn[1]);
    else if (turn && event.target === view.canvas) view.eye.orbit(turn[0] * 0.12, turn[1] * 0.12, 1);
    else if (event.key === "+" || event.key === "=") view.eye.orbit(0, 0, 1 / 1.2);
    else if (event.key === "-") view.eye.orbit(0, 0, 1.2);
    else if (event.key === "f" || event.key === "F") view.fit();
    else if (event.key === "n" || event.key === "N") corners.step(1);
    else if (event.key === "p" || event.key === "P") corners.step(-1);
    else if (event.key === " " && field !== "BUTTON" && field !== "SUMMARY") drive.play(!drive.running);
    else return;
    event.preventDefault();
  });
}

/** Paper is white, has all charts, and a photograph of the view. @param {View} view @param {Charts} charts */
function wirePrinting(view, charts) {
  /** @param {number} paper pixels, 0 for the screen */
  const change = (paper) => {
    document.documentElement.classList.toggle("paper", paper > 0);
    view.setScheme();
    charts.build(paper);
  };
  addEventListener("beforeprint", () => {
    change(PAPER);
    view.draw(0, true);
    const photo = element("photo");
    [photo.width, photo.height] = [view.canvas.width, view.canvas.height];
    photo.getContext("2d").drawImage(view.canvas, 0, 0);
  });
  addEventListener("afterprint", () => change(0));
}

/** @param {View} view @param {Drive} drive @param {Corners | Runs} corners @param {Record<string, Values>} arrays */
function wirePicking(view, drive, corners, arrays) {
  /** @type {[number, number] | null} */
  let pressed = null;
  view.canvas.addEventListener("pointerdown", (event) => (pressed = [event.offsetX, event.offsetY]));
  view.canvas.addEventListener("pointerup", (event) => {
    const moved = !pressed || Math.hypot(event.offsetX - pressed[0], event.offsetY - pressed[1]) > 4;
    if (moved) return;
    const found = view.pick(event.offsetX, event.offsetY);
    if (found && "corner" in found) corners.select(found.corner);
    else if (found) drive.set(arrays.w_time[found.point], "view");
  });
}
