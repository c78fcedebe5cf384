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
    showLegend(channel, meta, view.surface?.visible ? spanOf(arrays.s_off) : 0);
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
  showDistribution(meta, arrays);
  drive.set(arrays.w_time[Math.max(arrays.w_rapid.indexOf(0, 1), 0)] ?? 0, "start");
  view.mark(null);
  element("wait").hidden = true;
  view.resize();
  view.fit();
  // for tests and for the curious
  Object.assign(globalThis, { cornersmooth: { meta, arrays, view, charts, corners, drive, channels } });
  document.documentElement.dataset.ready = "true";
}

/** @param {Meta} meta */
function showHead(meta) {
  element("title").textContent = meta.title;
  element("verdict").textContent = meta.verdict;
  const badge = element("badge");
  badge.textContent = meta.badge;
  badge.classList.add(meta.badge.toLowerCase().replace(" ", "-"));
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

start().catch((/** @type {Error} */ error) => {
  const wait = element("wait");
  wait.hidden = false;
  wait.textContent = `This browser cannot show the page: ${error.message}`;
  console.error(error);
});
