// The machined surface: its points in the view, and how their distances are distributed.

/** Share of the points whose distances the colours tell apart; the others have the colours of the ends. */
const TOLD = 0.98;

/** Distance at which colours end, mm. @param {Values} off */
function spanOf(off) {
  const sizes = Float32Array.from(off, Math.abs).sort();
  const last = sizes[sizes.length - 1] || 1e-6;
  return Math.max(sizes[Math.floor(TOLD * (sizes.length - 1))] || last, last / 100);
}

/**
 * Points of the surface, joined to strips between neighbouring stations where they follow each other.
 * @param {Record<string, Values>} arrays @param {number} far longest distance of neighbours, mm
 */
function buildMetal(arrays, far) {
  const { s_tip: tip, s_off: off, s_station: station, s_level: level } = arrays;
  if (!off?.length) return null;
  const geometry = geometryOf(new Float32Array(tip));
  geometry.setAttribute("color", new THREE.BufferAttribute(signedColours(off, spanOf(off)), 3));
  const at = new Map();
  for (let i = 0; i < off.length; i++) at.set(station[i] * 256 + level[i], i);
  const index = [];
  for (let i = 0; i < off.length; i++) {
    const [s, l] = [station[i], level[i]];
    const corners = [i, at.get((s + 1) * 256 + l), at.get(s * 256 + l + 2), at.get((s + 1) * 256 + l + 2)];
    if (corners.some((corner) => corner === undefined)) continue;
    const [a, b, c, d] = corners;
    const gap = Math.hypot(tip[3 * a] - tip[3 * b], tip[3 * a + 1] - tip[3 * b + 1], tip[3 * a + 2] - tip[3 * b + 2]);
    if (gap < far) index.push(a, b, c, c, b, d);
  }
  const group = new THREE.Group();
  const strips = new THREE.BufferGeometry();
  for (const name of ["position", "color"]) strips.setAttribute(name, geometry.getAttribute(name));
  strips.setIndex(index);
  group.add(new THREE.Mesh(strips, new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.DoubleSide })));
  group.add(new THREE.Points(geometry, new THREE.PointsMaterial({ vertexColors: true, size: 5, sizeAttenuation: false })));
  return group;
}

/** Table and histogram of the distances. @param {Meta} meta @param {Record<string, Values>} arrays */
function showDistribution(meta, arrays) {
  const { surface } = meta;
  const box = element("metal");
  box.hidden = !surface;
  if (!surface) return;
  const table = made("table");
  /** @param {string} name @param {string[]} cells @param {string} kind */
  const row = (name, cells, kind) => {
    const line = made("tr");
    for (const cell of [name, ...cells]) line.append(made(kind, cell));
    table.append(line);
  };
  row("machined surface, mm", ["points", "largest", "95 %", "mean", "CL line"], "th");
  for (const [name, side] of /** @type {[string, Side][]} */ ([["overcut", surface.overcut], ["undercut", surface.undercut]])) {
    const size = [side.max_mm, side.percentile_95_mm, side.mean_mm].map(offset);
    row(name, [side.points.toLocaleString("en"), ...size, side.cl_line ? String(side.cl_line) : "–"], "td");
  }
  row("all", [surface.points.toLocaleString("en"), "", "", `rms ${offset(surface.rms_mm ?? NaN)}`, ""], "td");
  box.replaceChildren(table, histogram(arrays.h_edges, arrays.h_counts, spanOf(arrays.s_off)));
}

/** Bars of the classes, as high as their share; few are seen, too. @param {Values} edges @param {Values} counts @param {number} span of the colours */
function histogram(edges, counts, span) {
  const figure = made("div", "", "histogram");
  const most = Math.max(...counts, 1);
  const bars = made("div", "", "bars");
  bars.setAttribute("role", "img");
  bars.setAttribute("aria-label", `Histogram of ${counts.length} classes from ${told(edges[0])} to ${told(edges[counts.length])} mm`);
  const middles = Float32Array.from(counts, (_, k) => 0.5 * (edges[k] + edges[k + 1]));
  const colours = signedColours(middles, span);
  counts.forEach((/** @type {number} */ count, /** @type {number} */ k) => {
    const bar = made("span");
    // a scale of logarithms: one point in ten thousand is seen
    bar.style.height = `${count ? 4 + 96 * (Math.log1p(count) / Math.log1p(most)) : 0}%`;
    bar.style.background = new THREE.Color().fromArray(colours, 3 * k).getStyle();
    bar.title = `${told(edges[k])} to ${told(edges[k + 1])} mm: ${count.toLocaleString("en")} points`;
    bars.append(bar);
  });
  const scale = made("div", "", "ticks");
  for (const tick of [`${told(edges[0])} mm, overcut`, "0", `undercut, ${told(edges[counts.length])} mm`]) scale.append(made("span", tick));
  figure.append(made("small", `points in each class, from 1 to ${most.toLocaleString("en")}, logarithmic`), bars, scale);
  return figure;
}
