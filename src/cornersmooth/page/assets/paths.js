// Both paths and what the tool axis sweeps, in as much detail as is asked for.

/** More segments than this are drawn as thin lines. */
const MOST_WIDE = 20000;
/** Segments about a place that are looked at closely. */
const MOST_NEAR = 1500;
/** Pixels of the original and of the written path. */
const WIDTHS = { original: 1.4, written: 3 };

/**
 * How much is drawn: chords of each path and ribs of the surface, about; lines may be wide or not.
 * @typedef {{chords: number, ribs: number, wide: boolean}} Detail
 */

class Paths {
  /** @param {Record<string, Values>} arrays @param {number} height of the surface @param {Detail} detail */
  constructor(arrays, height, detail) {
    const { o_tip, o_move: move, w_tip, w_rapid: rapid } = arrays;
    const feed = (/** @type {number} */ i) => move[i] === 2;
    const cut = (/** @type {number} */ i) => !rapid[i];
    const every = Math.max(1, Math.ceil(Math.max(move.length, rapid.length) / detail.chords));
    this.segments = chords(rapid.length, cut, every);
    const wide = detail.wide && this.segments.length <= 2 * MOST_WIDE;
    this.original = lines(coordinates(o_tip, chords(move.length, feed, every)), WIDTHS.original, wide, false);
    this.original.renderOrder = 1;
    this.written = lines(coordinates(w_tip, this.segments), WIDTHS.written, wide, true);
    this.written.renderOrder = 2;
    this.ribPoints = /** @type {number[]} */ ([]);
    this.ribs = this.buildRibs(arrays, height, chords(rapid.length, cut, Math.max(1, Math.ceil(rapid.length / detail.ribs))));
    this.group = new THREE.Group();
    this.group.add(this.original, this.ribs, this.written);
  }

  /** Strips between the tool axes at the ends of chords. @param {Record<string, Values>} arrays @param {number} height @param {number[]} ends */
  buildRibs(arrays, height, ends) {
    const index = /** @type {number[]} */ ([]);
    for (let k = 0; k < ends.length; k += 2) {
      if (this.ribPoints[this.ribPoints.length - 1] !== ends[k]) this.ribPoints.push(ends[k]);
      const n = 2 * this.ribPoints.push(ends[k + 1]) - 4;
      index.push(n, n + 1, n + 2, n + 2, n + 1, n + 3);
    }
    const geometry = axisGeometry(arrays, this.ribPoints, height);
    geometry.setIndex(index);
    const look = { vertexColors: true, transparent: true, opacity: 0.3, side: THREE.DoubleSide, depthWrite: false };
    return new THREE.Mesh(geometry, new THREE.MeshBasicMaterial(look));
  }

  /** @param {Float32Array} colours three numbers for each written point */
  setColours(colours) {
    colourSegments(this.written, this.segments, colours);
    colourAxes(this.ribs, this.ribPoints, colours);
  }

  /** @param {number} width @param {number} height of the view, pixels */
  setSize(width, height) {
    setSizes([this.original, this.written], width, height);
  }
}

/** Segments about the place that is looked at: of a path too long for wide lines these are drawn wide. */
class Near {
  /** @param {Record<string, Values>} arrays */
  constructor(arrays) {
    this.arrays = arrays;
    this.group = new THREE.Group();
    this.original = /** @type {any} */ (null);
    this.written = /** @type {any} */ (null);
    this.segments = /** @type {number[]} */ ([]);
  }

  /**
   * Looks which segments come within a distance of a place.
   * @param {Vector} place @param {number} reach @param {Float32Array} colours
   */
  look(place, reach, colours) {
    const { o_tip, o_move: move, w_tip, w_rapid: rapid } = this.arrays;
    for (const object of [this.original, this.written]) if (object) object.geometry.dispose();
    this.group.clear();
    this.original = this.written = null;
    this.segments = segmentsNear(w_tip, rapid.length, (i) => !rapid[i], place, reach);
    const ends = segmentsNear(o_tip, move.length, (i) => move[i] === 2, place, reach);
    if (!this.segments.length || this.segments.length + ends.length > 4 * MOST_NEAR) return;
    this.written = lines(coordinates(w_tip, this.segments), WIDTHS.written, true, true);
    this.written.renderOrder = 2;
    colourSegments(this.written, this.segments, colours);
    this.group.add(this.written);
    if (!ends.length) return;
    this.original = lines(coordinates(o_tip, ends), WIDTHS.original, true, false);
    this.original.renderOrder = 1;
    this.group.add(this.original);
  }
}

/** @param {Float32Array} flat @param {number} width pixels @param {boolean} wide @param {boolean} coloured @returns {any} */
function lines(flat, width, wide, coloured) {
  return wide && flat.length ? wideLines(flat, width, coloured) : thinLines(flat, coloured);
}

/**
 * Ends of the segments that come within a distance of a place, as of `chords`; none where they are too many.
 * @param {Values} tip @param {number} count points @param {(i: number) => boolean} wanted @param {Vector} place @param {number} reach
 */
function segmentsNear(tip, count, wanted, place, reach) {
  const ends = /** @type {number[]} */ ([]);
  const { x, y, z } = place;
  for (let i = 1; i < count; i++) {
    if (!wanted(i)) continue;
    const k = 3 * i;
    const [px, py, pz] = [x - tip[k - 3], y - tip[k - 2], z - tip[k - 1]];
    const [dx, dy, dz] = [tip[k] - tip[k - 3], tip[k + 1] - tip[k - 2], tip[k + 2] - tip[k - 1]];
    const square = dx * dx + dy * dy + dz * dz;
    const share = square > 0 ? Math.min(Math.max((px * dx + py * dy + pz * dz) / square, 0), 1) : 0;
    const [ax, ay, az] = [px - share * dx, py - share * dy, pz - share * dz];
    if (ax * ax + ay * ay + az * az <= reach * reach) ends.push(i - 1, i);
  }
  return ends;
}

/** @param {any} object as of `lines` @param {number[]} segments @param {Float32Array} colours three numbers for each written point */
function colourSegments(object, segments, colours) {
  const flat = new Float32Array(segments.length * 3);
  for (let k = 0; k < segments.length; k += 2) {
    // a segment has the colour of the point it leads to at both ends where kinds meet, so that none bleeds
    const own = colours.subarray(3 * segments[k + 1], 3 * segments[k + 1] + 3);
    flat.set(own, 3 * k);
    flat.set(own, 3 * k + 3);
  }
  if (object instanceof THREE.LineSegments2) object.geometry.setColors(flat);
  else attribute(object, "color").copyArray(flat).needsUpdate = true;
}

/** @param {any[]} objects @param {number} width @param {number} height of the view, pixels */
function setSizes(objects, width, height) {
  for (const object of objects) if (object instanceof THREE.LineSegments2) object.material.resolution.set(width, height);
}
