// Puts the page together.

/** Pixels of a window up to which everything is in one column. */
const NARROW = 900;

async function start() {
  const meta = readMeta();
  showHead(meta);
  element("origin").textContent = `${meta.origin} line`;
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
  /** @param {Place | null} place @param {boolean} fly */
  const go = (place, fly) => {
    if (!place) return view.fit();
    view.show(place, fly);
    drive.set(place.second, "place");
  };
  const problems = new Problems(meta, arrays, (place) => {
    corners.select(-1);
    go(place, true);
  });
  const corners = meta.runs ? new Runs(meta, arrays, (place, run, fly) => {
    problems.select(-1);
    go(place, fly);
    if (fly && charts.scale === "way") charts.look(run.way[0], run.way[1]);
  }) : new Corners(meta, arrays, (place, fly) => {
    problems.select(-1);
    go(place, fly);
  });

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
  wirePrinting(view, charts);
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
  element("tools").open = innerWidth > NARROW;
  view.resize();
  view.fit();
  // the first problem is looked at; else the worst corner is marked in the whole, and enlarged beside it
  if (meta.problems[0]?.severity === "error") problems.select(0);
  else if (arrays.c_kind.length || meta.runs?.length) corners.select(meta.runs ? bestOf(meta.runs) : 0, false);
  // for tests and for the curious
  Object.assign(globalThis, { cornersmooth: { meta, arrays, view, charts, corners, problems, drive, channels } });
  document.documentElement.dataset.ready = "true";
}

/** The run that gains most, else the first. @param {Run[]} runs */
function bestOf(runs) {
  return runs.reduce((best, run, k) => ((gainOf(run) ?? -Infinity) > (gainOf(runs[best]) ?? -Infinity) ? k : best), 0);
}

/** @param {Meta} meta */
function showHead(meta) {
  element("title").textContent = meta.title;
  for (const [label, value] of meta.head) {
    const pair = made("div");
    pair.append(made("dt", label), made("dd", value));
    element("head").append(pair);
  }
  // the sentence begins with the word of the badge
  const [word, ...rest] = meta.verdict.startsWith(meta.badge) ? meta.verdict.split(": ") : [meta.badge, meta.verdict];
  element("verdict").textContent = rest.join(": ");
  const badge = element("badge");
  badge.textContent = word;
  badge.classList.add(meta.badge.toLowerCase().replace(" ", "-"));
  for (const [label, value] of meta.facts) element("facts").append(made("dt", label), made("dd", value));
  for (const note of meta.notes) element("notes").append(made("li", note));
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
