// The data of the page: plain values as JSON, arrays in one compressed block.

/** @typedef {{type: "f4" | "i4" | "u1", at: number, count: number, width: number}} Entry */
/** @typedef {Float32Array | Int32Array | Uint8Array} Values */
/** @typedef {{from_second: number, text: string, line: number, outline: number[][]}} ToolShape */
/** @typedef {{points: number, max_mm: number, mean_mm: number, percentile_95_mm: number, cl_line: number}} Side */
/** @typedef {{severity: string, nc_line: number, cl_line: number, text: string, code: string}} Problem */
/** @typedef {{points: number, rms_mm: number | null, overcut: Side, undercut: Side}} Metal */
/**
 * @typedef {object} Meta
 * @property {string} title
 * @property {string} verdict
 * @property {string} badge
 * @property {string} origin what the path is of: CL file or old program
 * @property {string[][]} head labels and values that are always in sight
 * @property {Problem[]} problems in the order in which they are looked at
 * @property {string[][]} facts
 * @property {string[]} notes
 * @property {number} tolerance mm
 * @property {number} axis_length mm
 * @property {string} axis_name what the deviations of the axis are of, in mm
 * @property {number[]} centre mm: what all coordinates are taken from
 * @property {number} seconds
 * @property {boolean} timed whether the seconds are planned; otherwise they are those of the programmed feed
 * @property {number} way mm
 * @property {Record<string, number>} totals seconds of each planned motion
 * @property {{kinds: string[], reasons: string[], counts: Record<string, number>} | null} corners
 * @property {{speeds: string[], axes: string[]}} charts
 * @property {ToolShape[]} tools
 * @property {Run[] | undefined} runs of a filtered program, in place of corners
 * @property {{count: number, line: number, reason: string}[] | undefined} left cuts of a filtered program that stay
 * @property {Metal | undefined} surface
 * @property {Record<string, Entry>} arrays
 */

/** @param {string} id @returns {any} the element; any, so that each use may treat it as what it is */
function element(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`no element ${id}`);
  return found;
}

/** @param {string} name @param {string} [text] @param {string} [style] class names */
function made(name, text = "", style = "") {
  const node = document.createElement(name);
  node.textContent = text;
  if (style) node.className = style;
  return node;
}

/** @returns {Meta} */
function readMeta() {
  return JSON.parse(element("values").textContent);
}

/**
 * @param {Record<string, Entry>} table
 * @returns {Promise<Record<string, Values>>}
 */
async function readArrays(table) {
  const node = element("arrays");
  const packed = bytesOf(node.textContent);
  node.remove();
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const buffer = await new Response(stream).arrayBuffer();
  const kinds = { f4: Float32Array, i4: Int32Array, u1: Uint8Array };
  /** @type {Record<string, Values>} */
  const arrays = {};
  for (const [name, entry] of Object.entries(table)) {
    arrays[name] = new kinds[entry.type](buffer, entry.at, entry.count * entry.width);
  }
  return arrays;
}

/** @param {string} text base64 @returns {Uint8Array<ArrayBuffer>} */
function bytesOf(text) {
  const characters = atob(text);
  const bytes = new Uint8Array(characters.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = characters.charCodeAt(i);
  return bytes;
}

/** Last index whose value is at most x in an ascending array. @param {Values} values @param {number} x */
function indexAt(values, x) {
  let low = 0;
  let high = values.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (values[middle] <= x) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** A number with few digits and its unit. @param {number} value @param {string} [unit] @param {number} [digits] */
function told(value, unit = "", digits = 3) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  const text = size >= 1e5 || (size > 0 && size < 1e-4) ? value.toExponential(2) : String(Number(value.toPrecision(digits)));
  return unit ? `${text} ${unit}` : text;
}

/** A length or a time of a whole path: six digits, thousands apart. @param {number} value */
function grouped(value) {
  return value.toLocaleString("en", { maximumSignificantDigits: 6 });
}

/** Seconds, from ten minutes on as hours, minutes and seconds. @param {number} value */
function clock(value) {
  if (value < 600) return `${value.toFixed(2)} s`;
  const whole = Math.floor(value);
  const parts = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  return `${parts[0]}:${parts.slice(1).map((part) => String(part).padStart(2, "0")).join(":")} h`;
}

/** Millimetres as deviations are told: to a tenth of a micrometre. @param {number} value */
function offset(value) {
  return Number.isFinite(value) ? value.toFixed(4) : "–";
}

/** An angle with as many decimals as it needs. @param {number} value */
function degrees(value) {
  return Number.isFinite(value) ? `${value.toFixed(value < 1 ? 3 : value < 10 ? 2 : 1)}°` : "–";
}
