// Small parts that the objects of the view are made of.

/**
 * Chords of the stretches of a path: start, end, start, end, ...
 * @param {number} count points @param {(i: number) => boolean} wanted whether the move to a point belongs to a stretch
 * @param {number} [every] points to a chord; stretches keep their ends
 */
function chords(count, wanted, every = 1) {
  const ends = /** @type {number[]} */ ([]);
  let start = 0;
  for (let i = 1; i < count; i++) {
    if (!wanted(i)) start = i;
    else if (i % every === 0 || i + 1 === count || !wanted(i + 1)) {
      ends.push(start, i);
      start = i;
    }
  }
  return ends;
}

/** Coordinates of some points. @param {Values} tip @param {number[]} points */
function coordinates(tip, points) {
  const flat = new Float32Array(points.length * 3);
  points.forEach((point, k) => flat.set(/** @type {Float32Array} */ (tip).subarray(3 * point, 3 * point + 3), 3 * k));
  return flat;
}

/** @param {Float32Array} flat three numbers for each point */
function geometryOf(flat) {
  return new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(flat, 3));
}

/** A point of a path. @param {Values} tip @param {number} i */
function vectorAt(tip, i) {
  return new THREE.Vector3(tip[3 * i], tip[3 * i + 1], tip[3 * i + 2]);
}

/** Segments as lines that are some pixels wide. @param {Float32Array} flat @param {number} width @param {boolean} coloured */
function wideLines(flat, width, coloured) {
  const geometry = new THREE.LineSegmentsGeometry();
  geometry.setPositions(flat);
  if (coloured) geometry.setColors(new Float32Array(flat.length));
  return new THREE.LineSegments2(geometry, new THREE.LineMaterial({ linewidth: width, vertexColors: coloured }));
}

/** Segments as the thinnest lines there are. @param {Float32Array} flat @param {boolean} coloured */
function thinLines(flat, coloured) {
  const geometry = geometryOf(flat);
  if (coloured) geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(flat.length), 3));
  return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: coloured }));
}

/**
 * The tool axis at some points: its foot and its end at the height, one behind the other.
 * @param {Record<string, Values>} arrays @param {number[]} points @param {number} height
 */
function axisGeometry(arrays, points, height) {
  const { w_tip: tip, w_axis: axis } = arrays;
  const position = new Float32Array(points.length * 6);
  points.forEach((i, k) => {
    for (let j = 0; j < 3; j++) {
      position[6 * k + j] = tip[3 * i + j];
      position[6 * k + 3 + j] = tip[3 * i + j] + height * axis[3 * i + j];
    }
  });
  return geometryOf(position).setAttribute("color", new THREE.BufferAttribute(new Float32Array(position.length), 3));
}

/**
 * Colours of a geometry of `axisGeometry`.
 * @param {any} object @param {number[]} points @param {Float32Array} colours three numbers for each written point
 */
function colourAxes(object, points, colours) {
  const own = new Float32Array(points.length * 6);
  points.forEach((i, k) => {
    own.set(colours.subarray(3 * i, 3 * i + 3), 6 * k);
    own.set(colours.subarray(3 * i, 3 * i + 3), 6 * k + 3);
  });
  attribute(object, "color").copyArray(own).needsUpdate = true;
}

/** @param {any} object @param {string} name @returns {Attribute} */
function attribute(object, name) {
  return object.geometry.getAttribute(name);
}

/** Markers of a fixed size on the screen. @param {Float32Array} flat @param {"diamond" | "ring" | "disk"} shape @param {number} size pixels */
function markers(flat, shape, size) {
  const look = { size, sizeAttenuation: false, map: sprite(shape), transparent: true, depthTest: false };
  const points = new THREE.Points(geometryOf(flat), new THREE.PointsMaterial(look));
  points.frustumCulled = false;
  return points;
}

/** Picture of a marker. @param {"diamond" | "ring" | "disk"} shape */
function sprite(shape) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.fillStyle = pen.strokeStyle = "#ffffff";
  pen.beginPath();
  if (shape === "diamond") {
    for (const [x, y] of [[32, 4], [60, 32], [32, 60], [4, 32]]) pen.lineTo(x, y);
    pen.closePath();
    pen.fill();
    pen.lineWidth = 5;
    pen.strokeStyle = "#000000";
    pen.stroke();
  } else {
    pen.arc(32, 32, shape === "ring" ? 26 : 24, 0, 2 * Math.PI);
    pen.lineWidth = 6;
    if (shape === "ring") pen.stroke();
    else pen.fill();
  }
  return new THREE.CanvasTexture(canvas);
}
