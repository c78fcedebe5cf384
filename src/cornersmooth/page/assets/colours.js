// Colour maps that keep their order for colour-blind eyes, and what can be shown by colour.

/** @typedef {[number, number, number]} Rgb 0 to 1, linear light as three.js computes with */

/** The middle of viridis, lighter at its lower end, so that it stands out from light and dark grounds alike (Smith, van der Walt 2015). */
const SEQUENTIAL_STOPS = ["#4f55b0", "#3f68ab", "#3376a2", "#298398", "#21918c", "#1fa187", "#2db27d", "#4ac16d", "#73d056", "#a0da39"];
/** From blue over grey to orange: less material on the orange side, more on the blue. */
const DIVERGING = ["#a63603", "#d9540d", "#f08a3c", "#eebb88", "#c9c9c9", "#9ecae1", "#5fa8d3", "#2f7fbb", "#08519c"];
/** Of Okabe and Ito, in the order of the kinds of corners. */
const KIND_COLOURS = ["#d55e00", "#e69f00", "#0072b2", "#56b4e9", "#0072b2"];
const OUTSIDE = "#d55e00";
const PLAIN = "#8c95a0";
/** Of the planned motions, and their names. */
const LAWS = /** @type {Record<string, [string, string]>} */ ({ direct: ["before", "#e69f00"], written: ["after", "#0072b2"] });

/** @param {string} hex @returns {Rgb} */
function rgb(hex) {
  const n = parseInt(hex.slice(1), 16);
  return [linear(n >> 16), linear((n >> 8) & 255), linear(n & 255)];
}

/** Linear light of a byte of sRGB. @param {number} byte */
function linear(byte) {
  const share = byte / 255;
  return share <= 0.04045 ? share / 12.92 : Math.pow((share + 0.055) / 1.055, 2.4);
}

/** Table of 256 colours between stops. @param {string[]} stops */
function ramp(stops) {
  const ends = stops.map(rgb);
  const table = new Float32Array(256 * 3);
  for (let i = 0; i < 256; i++) {
    const x = (i / 255) * (ends.length - 1);
    const k = Math.min(Math.floor(x), ends.length - 2);
    for (let j = 0; j < 3; j++) table[3 * i + j] = ends[k][j] + (x - k) * (ends[k + 1][j] - ends[k][j]);
  }
  return table;
}

/**
 * @typedef {object} Channel
 * @property {string} key
 * @property {string} title
 * @property {string} unit
 * @property {Values} values one for each written point
 * @property {number} low
 * @property {number} high
 * @property {boolean} [logarithmic]
 * @property {boolean} [bounded] whether values over `high` break the promise
 * @property {string[]} [names] of categories
 */

/** What the written path can be coloured by. @param {Meta} meta @param {Record<string, Values>} arrays @returns {Channel[]} */
function channelsOf(meta, arrays) {
  /** @type {Channel[]} */
  const channels = [];
  /** @param {string} key @param {string} title @param {string} unit @param {Partial<Channel>} [more] */
  const add = (key, title, unit, more = {}) => {
    const values = arrays[key];
    let low = Infinity;
    let high = -Infinity;
    for (const value of values) {
      if (!Number.isFinite(value) || (more.logarithmic && value <= 0)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
    if (high < low) return;
    if (more.logarithmic) low = Math.max(low, high / 1e4);
    else low = Math.min(low, 0);
    channels.push({ key, title, unit, values, low, high: high > low ? high : low + 1, ...more });
  };
  if (meta.corners) {
    channels.push({ key: "w_kind", title: "corner status", unit: "", values: arrays.w_kind, low: 0, high: 1, names: meta.corners.kinds });
  }
  const bounded = { low: 0, high: meta.tolerance, bounded: true };
  add("w_off", "deviation of the tip", "mm", bounded);
  add("w_axis_off", `deviation of the ${meta.axis_name}`, "mm", bounded);
  add("w_angle", "deviation of the tool axis", "°");
  add("w_speed", "planned speed", "mm/min");
  add("w_feed", "programmed feed", "mm/min");
  add("w_curvature", "curvature", "1/mm", { logarithmic: true });
  return channels;
}

const SEQUENTIAL = ramp(SEQUENTIAL_STOPS);
const SIGNED = ramp(DIVERGING);

/** Colours of the points, three numbers each. @param {Channel} channel */
function coloursOf(channel) {
  const { values, low, high } = channel;
  const colours = new Float32Array(values.length * 3);
  const plain = rgb(PLAIN);
  const outside = rgb(OUTSIDE);
  const kinds = KIND_COLOURS.map(rgb);
  for (let i = 0; i < values.length; i++) {
    const value = values[i];
    /** @type {ArrayLike<number>} */
    let colour = plain;
    let at = 0;
    if (channel.names) colour = kinds[value] ?? plain;
    else if (channel.bounded && value > high) colour = outside;
    else if (Number.isFinite(value)) {
      const share = channel.logarithmic ? Math.log(Math.max(value, low) / low) / Math.log(high / low) : (value - low) / (high - low);
      at = 3 * Math.round(255 * Math.min(Math.max(share, 0), 1));
      colour = SEQUENTIAL;
    }
    for (let j = 0; j < 3; j++) colours[3 * i + j] = colour[at + j];
  }
  return colours;
}

/** @param {Values} off @param {number} span */
function signedColours(off, span) {
  const colours = new Float32Array(off.length * 3);
  for (let i = 0; i < off.length; i++) {
    const at = 3 * Math.round(255 * Math.min(Math.max(0.5 + (0.5 * off[i]) / span, 0), 1));
    colours.set(SIGNED.subarray(at, at + 3), 3 * i);
  }
  return colours;
}

/** Draws the legend of a channel. @param {Channel} channel @param {Meta} meta @param {number} span at which colours of the surface end, mm; 0 without it */
function showLegend(channel, meta, span) {
  const box = element("legend");
  box.replaceChildren();
  /** @param {string} colour @param {string} text @param {string} [style] */
  const key = (colour, text, style = "") => {
    const line = made("span", "", "key");
    const swatch = made("span", "", `swatch ${style}`);
    swatch.style.background = colour;
    line.append(swatch, made("span", text));
    box.append(line);
  };
  /** @param {string[]} stops @param {string[]} ticks */
  const strip = (stops, ticks) => {
    const bar = made("span", "", "ramp");
    bar.style.background = `linear-gradient(to right, ${stops.join(",")})`;
    const line = made("span", "", "key");
    line.append(made("span", ticks[0]), bar, ...ticks.slice(1).map((tick) => made("span", tick)));
    box.append(line);
  };
  box.append(made("strong", `${channel.title}${channel.unit ? `, ${channel.unit}` : ""}`));
  if (channel.names) {
    const counts = meta.corners?.counts ?? {};
    channel.names.forEach((name, index) => {
      if (counts[name]) key(KIND_COLOURS[index], `${name}: ${counts[name].toLocaleString("en")}`, index < 2 ? "mark" : "");
    });
    key(PLAIN, "straight");
  } else {
    const { low, high } = channel;
    strip(SEQUENTIAL_STOPS, [told(low), told(high)]);
    let most = high;
    for (const value of channel.values) if (value > most) most = value;
    if (channel.bounded && most > high) key(OUTSIDE, `out of tolerance, up to ${told(most)}`);
  }
  if (span > 0) {
    box.append(made("strong", "machined surface, mm"));
    strip(DIVERGING, [`overcut ≤ −${told(span, "", 2)}`, "0", `undercut ≥ ${told(span, "", 2)}`]);
  }
  key("var(--original)", "original path");
}
