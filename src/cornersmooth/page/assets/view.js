// The view in three dimensions.

/** More segments than this are drawn as thin lines. */
const MOST_WIDE = 20000;
const MOST_WHISKERS = 1500;
const MOST_RIBS = 20000;
/** Chords of a path, and ribs, while the picture changes, if drawing everything is slow. */
const MOST_MOVING = 6000;
const MOST_MOVING_RIBS = 1500;
/** Milliseconds that a slow picture takes, and of rest before everything is drawn again. */
const SLOW = 50;
const REST = 250;
/** Milliseconds of a flight to a corner. */
const FLIGHT = 450;

class View {
  /** @param {Meta} meta @param {Record<string, Values>} arrays @param {HTMLCanvasElement} canvas */
  constructor(meta, arrays, canvas) {
    this.meta = meta;
    this.arrays = arrays;
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(30, 1, 0.1, 1000);
    this.camera.up.set(0, 0, 1);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.enableDamping = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.controls.dampingFactor = 0.15;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener("change", () => this.touch());
    this.scene.add(new THREE.AmbientLight(0xffffff, 1.6));
    const sun = new THREE.DirectionalLight(0xffffff, 2.2);
    sun.position.set(0.4, -0.7, 1);
    this.camera.add(sun);
    this.scene.add(this.camera);
    this.wide = /** @type {InstanceType<typeof THREE.LineMaterial>[]} */ ([]);
    this.height = meta.axis_length;
    this.bounds = this.boundsOf();
    this.wanted = { tool: true, original: true, written: true };
    /** @type {"surface" | "whiskers" | "none"} */
    this.axes = "surface";
    this.drawn = 0;
    this.waiting = false;
    this.measured = false;
    this.flight = 0;
    const { o_tip: tip, o_move: move } = arrays;
    this.rapids = new THREE.LineSegments(
      pairs(tip, chords(move.length, (i) => move[i] === 1)),
      new THREE.LineDashedMaterial({ color: 0xc08020, dashSize: this.bounds.radius / 60, gapSize: this.bounds.radius / 90 }),
    );
    this.rapids.computeLineDistances();
    this.rapids.visible = false;
    this.fine = this.buildPaths(1, MOST_RIBS);
    const points = Math.max(move.length, arrays.w_rapid.length);
    this.rough = points > MOST_WIDE ? this.buildPaths(Math.ceil(points / MOST_MOVING), MOST_MOVING_RIBS) : null;
    /** Whether drawing everything is slow; of a long path that is thought until it was measured. */
    this.slow = this.rough !== null;
    this.rest = 0;
    this.whiskers = this.buildWhiskers();
    this.markers = this.buildMarkers();
    this.ring = this.buildRing();
    this.surface = this.buildSurface();
    this.tool = new THREE.Group();
    /** @type {number} */
    this.toolShape = -1;
    this.spot = new THREE.Points(
      new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(new Float32Array(3), 3)),
      new THREE.PointsMaterial({ size: 11, sizeAttenuation: false, map: sprite("disk"), transparent: true, depthTest: false }),
    );
    this.spot.visible = false;
    this.spot.frustumCulled = false;
    this.spot.renderOrder = 6;
    for (const paths of [this.fine, this.rough]) if (paths) this.scene.add(paths.original, paths.ribs, paths.written);
    this.scene.add(this.rapids, this.whiskers, this.markers, this.ring, this.tool, this.spot);
    if (this.surface) this.scene.add(this.surface);
    this.setAxes(this.axes);
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    this.fit();
  }

  /** Sphere about all cutting moves; `this.cloud` has points of tip and axis for fitting. */
  boundsOf() {
    const { w_tip: tip, w_axis: axis, w_rapid: rapid } = this.arrays;
    const sphere = new THREE.Sphere();
    /** @type {Vector[]} */
    this.cloud = [];
    const step = Math.max(1, Math.floor(rapid.length / 6000));
    for (let i = 0; i < rapid.length; i += step) {
      if (rapid[i]) continue;
      const foot = new THREE.Vector3(tip[3 * i], tip[3 * i + 1], tip[3 * i + 2]);
      const lean = new THREE.Vector3(axis[3 * i], axis[3 * i + 1], axis[3 * i + 2]);
      this.cloud.push(foot, foot.clone().addScaledVector(lean, this.height / 32767));
    }
    if (!this.cloud.length) this.cloud.push(new THREE.Vector3());
    sphere.setFromPoints(this.cloud);
    sphere.radius = Math.max(sphere.radius, 1e-3);
    return sphere;
  }

  /**
   * Both paths and the ruled surface that the tool axis sweeps over its length H.
   * @param {number} every points to a chord @param {number} most ribs of the surface, about
   */
  buildPaths(every, most) {
    const { o_tip, o_move: move, w_tip, w_rapid: rapid } = this.arrays;
    const width = every === 1 ? 1 : 0;
    const original = this.line(o_tip, chords(move.length, (i) => move[i] === 2, every), 1.4 * width, false);
    original.renderOrder = 1;
    const segments = chords(rapid.length, (i) => !rapid[i], every);
    const written = this.line(w_tip, segments, 3 * width, true);
    written.renderOrder = 2;
    const strips = chords(rapid.length, (i) => !rapid[i], Math.max(1, Math.ceil(rapid.length / most)));
    return { original, written, segments, ...this.buildRibs(strips) };
  }

  /**
   * Some segments of a path.
   * @param {Values} tip @param {number[]} ends as of `chords` @param {number} width pixels; thin if not above 1 @param {boolean} coloured
   */
  line(tip, ends, width, coloured) {
    const geometry = pairs(tip, ends);
    const blank = new Float32Array(ends.length * 3);
    if (width <= 1 || ends.length > 2 * MOST_WIDE) {
      if (coloured) geometry.setAttribute("color", new THREE.BufferAttribute(blank, 3));
      return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: coloured }));
    }
    const wide = new THREE.LineSegmentsGeometry();
    wide.setPositions(/** @type {Float32Array} */ (geometry.getAttribute("position").array));
    if (coloured) wide.setColors(blank);
    const material = new THREE.LineMaterial({ linewidth: width, vertexColors: coloured });
    this.wide.push(material);
    return new THREE.LineSegments2(wide, material);
  }

  /** Strips between the tool axes at the ends of chords. @param {number[]} ends */
  buildRibs(ends) {
    const { w_tip: tip, w_axis: axis } = this.arrays;
    const ribPoints = /** @type {number[]} */ ([]);
    const index = /** @type {number[]} */ ([]);
    for (let k = 0; k < ends.length; k += 2) {
      if (ribPoints[ribPoints.length - 1] !== ends[k]) ribPoints.push(ends[k]);
      const n = 2 * ribPoints.push(ends[k + 1]) - 4;
      index.push(n, n + 1, n + 2, n + 2, n + 1, n + 3);
    }
    const position = new Float32Array(ribPoints.length * 6);
    ribPoints.forEach((i, k) => {
      for (let j = 0; j < 3; j++) {
        position[6 * k + j] = tip[3 * i + j];
        position[6 * k + 3 + j] = tip[3 * i + j] + (this.height * axis[3 * i + j]) / 32767;
      }
    });
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(position.length), 3));
    geometry.setIndex(index);
    const material = new THREE.MeshBasicMaterial({
      vertexColors: true, transparent: true, opacity: 0.3, side: THREE.DoubleSide, depthWrite: false,
    });
    return { ribs: new THREE.Mesh(geometry, material), ribPoints };
  }

  buildWhiskers() {
    const { w_tip: tip, w_axis: axis, w_rapid: rapid } = this.arrays;
    const step = Math.max(1, Math.ceil(rapid.length / MOST_WHISKERS));
    this.whiskerPoints = /** @type {number[]} */ ([]);
    for (let i = 0; i < rapid.length; i += step) if (!rapid[i]) this.whiskerPoints.push(i);
    const position = new Float32Array(this.whiskerPoints.length * 6);
    this.whiskerPoints.forEach((i, k) => {
      for (let j = 0; j < 3; j++) {
        position[6 * k + j] = tip[3 * i + j];
        position[6 * k + 3 + j] = tip[3 * i + j] + (this.height * axis[3 * i + j]) / 32767;
      }
    });
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(position.length), 3));
    return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.75 }));
  }

  /** Sharp corners, and those out of tolerance, stand out at any distance. */
  buildMarkers() {
    const group = new THREE.Group();
    const { c_tip: tip, c_kind: kind } = this.arrays;
    if (!kind) return group;
    for (const wanted of [1, 0]) {
      const chosen = [];
      for (let i = 0; i < kind.length; i++) if (kind[i] === wanted) chosen.push(tip[3 * i], tip[3 * i + 1], tip[3 * i + 2]);
      if (!chosen.length) continue;
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(chosen), 3));
      const points = new THREE.Points(
        geometry,
        new THREE.PointsMaterial({
          color: KIND_COLOURS[wanted], size: wanted ? 12 : 14, sizeAttenuation: false, map: sprite("diamond"), transparent: true, depthTest: false,
        }),
      );
      points.renderOrder = 4;
      group.add(points);
    }
    return group;
  }

  buildRing() {
    const geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(new Float32Array(3), 3));
    const ring = new THREE.Points(
      geometry,
      new THREE.PointsMaterial({ size: 30, sizeAttenuation: false, map: sprite("ring"), transparent: true, depthTest: false }),
    );
    ring.frustumCulled = false;
    ring.visible = false;
    ring.renderOrder = 5;
    return ring;
  }

  /** Points of the machined surface, joined to strips between neighbouring stations where they follow each other. */
  buildSurface() {
    const { s_tip: tip, s_off: off, s_station: station, s_level: level } = this.arrays;
    if (!this.meta.surface || !off.length) return null;
    const colours = signedColours(off, this.meta.surface.span);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(tip), 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
    const at = new Map();
    for (let i = 0; i < off.length; i++) at.set(station[i] * 256 + level[i], i);
    const index = [];
    const far = this.bounds.radius / 8;
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
    strips.setAttribute("position", geometry.getAttribute("position"));
    strips.setAttribute("color", geometry.getAttribute("color"));
    strips.setIndex(index);
    group.add(new THREE.Mesh(strips, new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.DoubleSide })));
    group.add(new THREE.Points(geometry, new THREE.PointsMaterial({ vertexColors: true, size: 3, sizeAttenuation: false })));
    return group;
  }

  /** @param {Float32Array} colours three numbers for each written point */
  setColours(colours) {
    const drawn = /** @type {[any, number[]][]} */ ([[this.whiskers, this.whiskerPoints]]);
    for (const paths of [this.fine, this.rough]) {
      if (!paths) continue;
      const { segments, written, ribs, ribPoints } = paths;
      const flat = new Float32Array(segments.length * 3);
      for (let k = 0; k < segments.length; k += 2) {
        // a segment has the colour of the point it leads to at both ends where kinds meet, so that none bleeds
        const own = colours.subarray(3 * segments[k + 1], 3 * segments[k + 1] + 3);
        flat.set(own, 3 * k);
        flat.set(own, 3 * k + 3);
      }
      if (written instanceof THREE.LineSegments2) written.geometry.setColors(flat);
      else attribute(written, "color").copyArray(flat).needsUpdate = true;
      drawn.push([ribs, ribPoints]);
    }
    for (const [object, points] of drawn) {
      const own = new Float32Array(points.length * 6);
      points.forEach((i, k) => {
        own.set(colours.subarray(3 * i, 3 * i + 3), 6 * k);
        own.set(colours.subarray(3 * i, 3 * i + 3), 6 * k + 3);
      });
      attribute(object, "color").copyArray(own).needsUpdate = true;
    }
    this.touch();
  }

  /** @param {"surface" | "whiskers" | "none"} axes */
  setAxes(axes) {
    this.axes = axes;
    this.touch();
  }

  /** Colours of the scheme. */
  setScheme() {
    const style = getComputedStyle(document.documentElement);
    /** @param {string} name */
    const colour = (name) => new THREE.Color(style.getPropertyValue(name).trim());
    this.scene.background = colour("--stage");
    for (const paths of [this.fine, this.rough]) if (paths) /** @type {any} */ (paths.original.material).color = colour("--original");
    /** @type {any} */ (this.spot.material).color = colour("--accent");
    /** @type {any} */ (this.ring.material).color = colour("--text");
    this.touch();
  }

  /** Everything into the view, from a corner of the room. */
  fit() {
    const from = new THREE.Vector3(0.55, -0.72, 0.5).normalize();
    const right = new THREE.Vector3().crossVectors(this.camera.up, from).normalize();
    const up = new THREE.Vector3().crossVectors(from, right);
    const high = Math.tan((Math.PI / 360) * this.camera.fov);
    const broad = high * (this.camera.aspect || 1);
    const target = this.bounds.center.clone();
    let distance = 0;
    for (let round = 0; round < 3; round++) {
      // sides of the cone of sight that touch the cloud; the middle between them is looked at
      const reach = [-Infinity, -Infinity, -Infinity, -Infinity];
      for (const point of this.cloud ?? []) {
        const arm = point.clone().sub(target);
        const [x, y, z] = [arm.dot(right), arm.dot(up), arm.dot(from)];
        [x / broad, -x / broad, y / high, -y / high].forEach((side, k) => (reach[k] = Math.max(reach[k], side + z)));
      }
      target.addScaledVector(right, 0.5 * broad * (reach[0] - reach[1])).addScaledVector(up, 0.5 * high * (reach[2] - reach[3]));
      distance = 1.12 * Math.max(0.5 * (reach[0] + reach[1]), 0.5 * (reach[2] + reach[3]), 1e-3);
    }
    this.flyTo(target, distance, from);
  }

  /**
   * Moves the camera so that it looks at a point.
   * @param {Vector} target @param {number} distance @param {Vector} [from] direction to look from
   */
  flyTo(target, distance, from) {
    const begin = { target: this.controls.target.clone(), position: this.camera.position.clone() };
    const way = from ? from.clone() : begin.position.clone().sub(begin.target).normalize();
    const end = target.clone().addScaledVector(way, distance);
    const still = this.drawn === 0 || matchMedia("(prefers-reduced-motion: reduce)").matches;
    const started = performance.now();
    const flight = ++this.flight;
    const step = () => {
      if (flight !== this.flight) return;
      const share = still ? 1 : Math.min((performance.now() - started) / FLIGHT, 1);
      const eased = share * share * (3 - 2 * share);
      // distances shrink evenly in proportion, so that a flight into a corner does not end with a jump
      const size = begin.position.distanceTo(begin.target) || distance;
      const reach = size * Math.pow(distance / size, eased);
      const heading = begin.position.clone().sub(begin.target).normalize().lerp(way, eased).normalize();
      const aim = begin.target.clone().lerp(target, size > distance ? 1 - Math.pow(1 - eased, 3) : eased);
      this.controls.target.copy(share === 1 ? target : aim);
      this.camera.position.copy(share === 1 ? end : aim.addScaledVector(heading.lengthSq() ? heading : way, reach));
      this.touch();
      if (share < 1) requestAnimationFrame(step);
    };
    step();
  }

  /** @param {number} i row of the list of corners */
  showCorner(i) {
    const { c_tip: tip, c_length: length } = this.arrays;
    const target = new THREE.Vector3(tip[3 * i], tip[3 * i + 1], tip[3 * i + 2]);
    attribute(this.ring, "position").setXYZ(0, target.x, target.y, target.z).needsUpdate = true;
    this.ring.visible = true;
    const size = Math.max(3 * (length[i] || 0), 20 * this.meta.tolerance, this.bounds.radius / 1000);
    this.flyTo(target, Math.min(size, this.bounds.radius) * 1.5);
  }

  /** Marks a place on the path. @param {number[] | null} at */
  mark(at) {
    this.spot.visible = at !== null;
    if (at) attribute(this.spot, "position").setXYZ(0, at[0], at[1], at[2]).needsUpdate = true;
    this.touch();
  }

  /** Puts the tool somewhere. @param {number} shape number of the tool @param {number[]} tip @param {number[]} axis */
  placeTool(shape, tip, axis) {
    if (shape !== this.toolShape) {
      this.toolShape = shape;
      this.tool.clear();
      const outline = this.meta.tools[shape]?.outline ?? [[0, 0], [0.06 * this.height, 0.25 * this.height], [0.06 * this.height, this.height]];
      const closed = [...outline, [0, outline[outline.length - 1][1]]].map(([r, h]) => new THREE.Vector2(r, h));
      const body = new THREE.LatheGeometry(closed, 48);
      body.rotateX(Math.PI / 2);
      const look = { color: 0x9fb4c8, metalness: 0.35, roughness: 0.45, transparent: true, opacity: 0.42, side: THREE.DoubleSide, depthWrite: false };
      const mesh = new THREE.Mesh(body, new THREE.MeshStandardMaterial(look));
      mesh.renderOrder = 3;
      this.tool.add(mesh);
    }
    this.tool.position.set(tip[0], tip[1], tip[2]);
    this.tool.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), new THREE.Vector3(axis[0], axis[1], axis[2]).normalize());
    this.touch();
  }

  /** What lies under a place of the canvas. @param {number} x @param {number} y @returns {{corner: number} | {point: number} | null} */
  pick(x, y) {
    const { c_tip: corners, c_kind: kind, w_tip: tip, w_rapid: rapid } = this.arrays;
    const near = (/** @type {Values} */ places, /** @type {(i: number) => boolean} */ wanted, /** @type {number} */ reach) => {
      const point = new THREE.Vector3();
      let best = -1;
      let least = reach * reach;
      for (let i = 0; i < places.length / 3; i++) {
        if (!wanted(i)) continue;
        point.set(places[3 * i], places[3 * i + 1], places[3 * i + 2]).project(this.camera);
        if (point.z > 1) continue;
        const dx = (0.5 + 0.5 * point.x) * this.canvas.clientWidth - x;
        const dy = (0.5 - 0.5 * point.y) * this.canvas.clientHeight - y;
        if (dx * dx + dy * dy < least) {
          least = dx * dx + dy * dy;
          best = i;
        }
      }
      return best;
    };
    if (kind) {
      const corner = near(corners, (i) => kind[i] < 2, 13);
      if (corner >= 0) return { corner };
    }
    const point = near(tip, (i) => !rapid[i], 14);
    return point >= 0 ? { point } : null;
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    for (const material of this.wide) material.resolution.set(width, height);
    this.touch();
  }

  /** Draws soon; as often as it is asked, once a frame. Where all is slow, roughly, and all of it after a rest. */
  touch() {
    clearTimeout(this.rest);
    if (this.rough && this.slow) this.rest = setTimeout(() => requestAnimationFrame(() => this.drawFully()), REST);
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.controls.update();
      this.draw(this.rough !== null && this.slow);
    });
  }

  /** Draws everything, and measures how long that takes; reading a pixel waits for the end. */
  drawFully() {
    const gl = this.renderer.getContext();
    const begin = performance.now();
    this.draw(false);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    // the first time buffers and programs are made, which is not counted
    if (this.measured) this.slow = performance.now() - begin > SLOW;
    else requestAnimationFrame(() => this.drawFully());
    this.measured = true;
  }

  /** @param {boolean} roughly */
  draw(roughly) {
    const { wanted } = this;
    const distance = this.camera.position.distanceTo(this.controls.target);
    for (const paths of [this.fine, this.rough]) {
      if (!paths) continue;
      const own = roughly === (paths === this.rough);
      paths.original.visible = own && wanted.original;
      paths.written.visible = own && wanted.written;
      // close by, the tool and the surface of its axis would stand before the eye
      paths.ribs.visible = paths.written.visible && this.axes === "surface" && distance > 0.8 * this.height;
    }
    this.tool.visible = wanted.tool && distance > 1.2 * this.height;
    this.whiskers.visible = this.axes === "whiskers" && wanted.written;
    this.camera.near = Math.max(distance / 200, 1e-4);
    this.camera.far = distance + 6 * this.bounds.radius;
    this.camera.updateProjectionMatrix();
    this.renderer.render(this.scene, this.camera);
    this.drawn++;
  }
}

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

/** Segments between points. @param {Values} tip @param {number[]} ends as of `chords` */
function pairs(tip, ends) {
  const flat = new Float32Array(ends.length * 3);
  ends.forEach((end, k) => flat.set(/** @type {Float32Array} */ (tip).subarray(3 * end, 3 * end + 3), 3 * k));
  return new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(flat, 3));
}

/** @param {any} object @param {string} name @returns {Attribute} */
function attribute(object, name) {
  return object.geometry.getAttribute(name);
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
