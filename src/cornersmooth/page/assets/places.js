// Places that are looked at: corners, and points of the written path that a problem is about.

/**
 * @typedef {object} Place
 * @property {Vector} tip
 * @property {Vector} axis unit vector
 * @property {number} way along the original path, mm
 * @property {number} second when the tool is there
 * @property {number} off of the tip, mm
 * @property {number} axisOff of the axis point, mm
 * @property {number} length that a rounded corner takes of the path, mm
 */

/** @param {Record<string, Values>} arrays @param {"c" | "w"} path corners or written points @param {number} i @returns {Place} */
function placeOf(arrays, path, i) {
  const way = arrays[`${path}_way`][i];
  const second = path === "w" ? arrays.w_time[i] : arrays.w_time[indexAt(arrays.w_way, way)];
  const [off, axisOff, length] = ["off", "axis_off", "length"].map((key) => arrays[`${path}_${key}`]?.[i] || 0);
  return { tip: vectorAt(arrays[`${path}_tip`], i), axis: vectorAt(arrays[`${path}_axis`], i), way, second, off, axisOff, length };
}

/**
 * Point of the written path that a problem is about: of its line the one that is off most, else the last before the line.
 * @param {Record<string, Values>} arrays @param {Problem} problem @returns {Place | null}
 */
function placeOfProblem(arrays, problem) {
  const [lines, line] = problem.nc_line ? [arrays.w_nc, problem.nc_line] : [arrays.w_line, problem.cl_line];
  let [best, most, before] = [-1, -1, -1];
  for (let i = 0; line && i < lines.length; i++) {
    if (lines[i] < line && lines[i] > 0) before = i;
    const off = lines[i] === line ? Math.max(arrays.w_off[i] || 0, arrays.w_axis_off[i] || 0) : -1;
    if (off > most) [best, most] = [i, off];
  }
  const found = best < 0 ? before : best;
  return found < 0 ? null : placeOf(arrays, "w", found);
}

const INSET = { width: 320, height: 180 };
/** Pixels of a millimetre of the screen. */
const PIXELS = 96 / 25.4;

/**
 * Both paths about a place, enlarged, in the plane in which they part; the original has a band as wide as the tolerance.
 * The axis points are drawn where those are farther off.
 * @param {Meta} meta @param {Record<string, Values>} arrays @param {Place} place
 */
function insetOf(meta, arrays, place) {
  const high = place.axisOff > place.off ? meta.axis_length : 0;
  const middle = place.tip.clone().addScaledVector(place.axis, high);
  const reach = 3 * Math.max(place.off, place.axisOff, meta.tolerance);
  const { o_move: move, w_rapid: rapid, w_off: off, w_axis_off: axisOff } = arrays;
  const original = stretch(arrays, "o", place.way, 2 * reach, middle, high, (i) => move[i] === 2);
  const written = stretch(arrays, "w", place.way, 2 * reach, middle, high, (i) => !rapid[i]);
  const along = headingOf(original.length ? original : written);
  let across = new THREE.Vector3();
  for (const { at } of [...original, ...written]) {
    const side = at.clone().addScaledVector(along, -at.dot(along));
    if (at.length() < 2 * reach && side.lengthSq() > across.lengthSq()) across = side;
  }
  if (!across.lengthSq()) across.set(0.1, 0.2, 1).addScaledVector(along, -0.2);
  across.addScaledVector(along, -across.dot(along)).normalize();
  const scale = INSET.height / 2 / reach;
  /** @param {Vector} at */
  const seen = (at) => `${(INSET.width / 2 + scale * at.dot(along)).toFixed(2)} ${(INSET.height / 2 - scale * at.dot(across)).toFixed(2)}`;
  /** @param {Passed[]} points @param {(i: number) => boolean} wanted */
  const drawn = (points, wanted) =>
    points.map(({ at, i, on }, k) => `${k && on && wanted(i) ? "L" : "M"}${seen(at)}`).join("");
  const picture = element("drawing").content.firstElementChild.cloneNode(true);
  const [band, before, after, out, bar, text] = picture.children;
  for (const line of [band, before]) line.setAttribute("d", drawn(original, () => true));
  band.setAttribute("stroke-width", String(2 * meta.tolerance * scale));
  after.setAttribute("d", drawn(written, () => true));
  out.setAttribute("d", drawn(written, (i) => Math.max(off[i] || 0, axisOff[i] || 0) > meta.tolerance));
  const length = roundBelow(INSET.width / 4 / scale);
  bar.setAttribute("d", `M10 ${INSET.height - 10}h${length * scale}`);
  text.textContent = `${told(length)} mm`;
  const figure = made("figure");
  const what = high ? `axis point, ${told(high)} mm up the tool` : "tip";
  figure.append(picture, made("figcaption", `${what}, ${grouped(Number((scale / PIXELS).toPrecision(2)))} times as large; grey: original with its tolerance`));
  return figure;
}

/** @typedef {{at: Vector, i: number, on: boolean}} Passed a point, and whether the tool cuts on its way there */

/**
 * Points of a path from the one at a way on until it has gone out of reach on either side, seen from the middle.
 * @param {Record<string, Values>} arrays @param {"o" | "w"} path @param {number} way @param {number} reach
 * @param {Vector} middle @param {number} high @param {(i: number) => boolean} cuts @returns {Passed[]}
 */
function stretch(arrays, path, way, reach, middle, high, cuts) {
  const ways = arrays[`${path}_way`];
  /** @param {number} i @returns {Passed} */
  const passed = (i) => {
    const at = vectorAt(arrays[`${path}_tip`], i).addScaledVector(vectorAt(arrays[`${path}_axis`], i), high);
    return { at: at.sub(middle), i, on: cuts(i) };
  };
  const points = [passed(indexAt(ways, way))];
  for (const step of [-1, 1]) {
    let last = step < 0 ? points[0] : points[points.length - 1];
    // the point at the way itself may be out of reach where the tip stands still
    for (let n = 0; last.i + step >= 0 && last.i + step < ways.length && (n < 2 || last.at.length() < reach); n++) {
      last = passed(last.i + step);
      if (step < 0) points.unshift(last);
      else points.push(last);
    }
  }
  return points;
}

/** Direction of the move that comes nearest to the middle. @param {Passed[]} points */
function headingOf(points) {
  let [best, least] = [new THREE.Vector3(1, 0, 0), Infinity];
  for (let k = 1; k < points.length; k++) {
    const [from, to] = [points[k - 1].at, points[k].at];
    const move = to.clone().sub(from);
    if (!points[k].on || move.lengthSq() === 0) continue;
    const share = Math.min(Math.max(-from.dot(move) / move.lengthSq(), 0), 1);
    const away = from.clone().addScaledVector(move, share).length();
    if (away < least) [best, least] = [move.normalize(), away];
  }
  return best;
}

/** The largest of 1, 2, 5, 10, ... that is not above a length. @param {number} length */
function roundBelow(length) {
  const ten = Math.pow(10, Math.floor(Math.log10(length)));
  return ten * ([5, 2].find((step) => step * ten <= length) ?? 1);
}
