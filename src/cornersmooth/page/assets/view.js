// The view in three dimensions: its objects, and what of them is drawn.

/** Everything, and coarser ones for pictures that move. */
const DETAILS = /** @type {Detail[]} */ ([
  { chords: Infinity, ribs: 20000, wide: true },
  { chords: 6000, ribs: 1000, wide: false },
  { chords: 2500, ribs: 250, wide: false },
]);
/** Pixels of a picture for each of the screen at the coarsest level. */
const COARSE = 0.75;
/** Renderers that have no graphics card. */
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

class View {
  /** @param {Meta} meta @param {Record<string, Values>} arrays @param {HTMLCanvasElement} canvas */
  constructor(meta, arrays, canvas) {
    this.meta = meta;
    this.arrays = arrays;
    this.canvas = canvas;
    this.height = meta.axis_length;
    const software = drawsInSoftware();
    // without a card smooth edges cost more than more pixels, and only pictures at rest have those
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !software, alpha: false, powerPreference: "high-performance" });
    this.fineness = software ? 2 : Math.min(devicePixelRatio, 2);
    this.eye = new Eye(canvas, cloudOf(arrays, this.height), () => this.touch());
    this.radius = this.eye.sphere.radius;
    this.scene = new THREE.Scene();
    this.scene.add(new THREE.AmbientLight(0xffffff, 1.6), this.eye.camera);
    const sun = new THREE.DirectionalLight(0xffffff, 2.2);
    sun.position.set(0.4, -0.7, 1);
    this.eye.camera.add(sun);
    this.wanted = { tool: true, original: true, written: true, axes: true };
    /** @type {Float32Array} */
    this.colours = new Float32Array(arrays.w_tip.length);
    this.gray = new THREE.Color();
    /** @type {(Paths | null)[]} made when they are needed */
    this.paths = DETAILS.map(() => null);
    this.near = new Near(arrays);
    this.rapids = this.buildRapids();
    this.ring = this.buildMark("ring", 30, 5);
    this.spot = this.buildMark("disk", 11, 6);
    this.surface = meta.surface ? buildMetal(arrays, this.radius / 8) : null;
    this.tool = new ToolBody(meta.tools, this.height);
    this.scene.add(this.near.group, this.rapids, this.buildMarkers(), this.ring, this.tool.group, this.spot);
    if (this.surface) this.scene.add(this.surface);
    this.pace = new Pace(DETAILS.length - 1, (level, still) => this.draw(level, still), () => this.finish());
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    this.fit();
  }

  /** @param {number} level */
  pathsOf(level) {
    let paths = this.paths[level];
    if (!paths) {
      paths = this.paths[level] = new Paths(this.arrays, this.height, DETAILS[level]);
      paths.setColours(this.colours);
      paths.original.material.color = this.gray;
      paths.setSize(this.eye.size.width, this.eye.size.height);
      this.scene.add(paths.group);
    }
    return paths;
  }

  buildRapids() {
    const { o_tip: tip, o_move: move } = this.arrays;
    const ends = chords(move.length, (i) => move[i] === 1);
    const look = { color: 0xc08020, dashSize: this.radius / 60, gapSize: this.radius / 90 };
    const rapids = new THREE.LineSegments(geometryOf(coordinates(tip, ends)), new THREE.LineDashedMaterial(look));
    rapids.computeLineDistances();
    rapids.visible = false;
    return rapids;
  }

  /** Sharp corners, and those out of tolerance, stand out at any distance. */
  buildMarkers() {
    const group = new THREE.Group();
    const { c_tip: tip, c_kind: kind } = this.arrays;
    for (const wanted of kind ? [1, 0] : []) {
      const chosen = /** @type {number[]} */ ([]);
      kind.forEach((own, i) => own === wanted && chosen.push(i));
      if (!chosen.length) continue;
      const points = markers(coordinates(tip, chosen), "diamond", wanted ? 12 : 14);
      points.material.color.set(KIND_COLOURS[wanted]);
      points.renderOrder = 4;
      group.add(points);
    }
    return group;
  }

  /** @param {"ring" | "disk"} shape @param {number} size @param {number} order */
  buildMark(shape, size, order) {
    const mark = markers(new Float32Array(3), shape, size);
    mark.visible = false;
    mark.renderOrder = order;
    return mark;
  }

  /** @param {Float32Array} colours three numbers for each written point */
  setColours(colours) {
    this.colours = colours;
    for (const paths of this.paths) paths?.setColours(colours);
    if (this.near.written) colourSegments(this.near.written, this.near.segments, colours);
    this.touch();
  }

  /** Colours of the scheme. */
  setScheme() {
    const style = getComputedStyle(document.documentElement);
    /** @param {string} name */
    const colour = (name) => new THREE.Color(style.getPropertyValue(name).trim());
    this.scene.background = colour("--stage");
    this.gray.copy(colour("--original"));
    this.spot.material.color = colour("--accent");
    this.ring.material.color = colour("--text");
    this.touch();
  }

  fit() {
    this.eye.fit();
  }

  /** Puts a ring about a place. @param {Place} place @param {boolean} fly whether the view goes there */
  show(place, fly) {
    const { tip, off, axisOff, length } = place;
    attribute(this.ring, "position").setXYZ(0, tip.x, tip.y, tip.z).needsUpdate = true;
    this.ring.visible = true;
    this.touch();
    if (!fly) return;
    const { tolerance } = this.meta;
    // where nothing is off and nothing rounded the tool is to be seen
    const size = off || axisOff || length ? Math.max(3 * length, 6 * off, 6 * axisOff, 20 * tolerance) : 2 * this.height;
    this.eye.flyTo(tip, Math.min(Math.max(size, this.radius / 1000), this.radius) * 1.5);
  }

  /** Marks a place on the path. @param {number[] | null} at */
  mark(at) {
    this.spot.visible = at !== null;
    if (at) attribute(this.spot, "position").setXYZ(0, at[0], at[1], at[2]).needsUpdate = true;
    this.touch();
  }

  /** Puts the tool somewhere. @param {number} shape number of the tool @param {number[]} tip @param {number[]} axis */
  placeTool(shape, tip, axis) {
    this.tool.place(shape, tip, axis);
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
        const seen = this.eye.onCanvas(point.set(places[3 * i], places[3 * i + 1], places[3 * i + 2]));
        const away = seen ? (seen[0] - x) ** 2 + (seen[1] - y) ** 2 : Infinity;
        if (away < least) [least, best] = [away, i];
      }
      return best;
    };
    const corner = kind ? near(corners, (i) => kind[i] < 2, 13) : -1;
    if (corner >= 0) return { corner };
    const point = near(tip, (i) => !rapid[i], 14);
    return point >= 0 ? { point } : null;
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    const stage = this.canvas.getBoundingClientRect();
    /** @param {string} id of what may lie over the view */
    const box = (id) => element(id).getBoundingClientRect();
    const [tools, legend] = ["tools", "legend"].map(box);
    const over = getComputedStyle(element("legend")).position === "absolute";
    this.eye.setSize({ width, height, top: over ? tools.bottom - stage.top : 0, bottom: over ? stage.bottom - legend.top : 0 });
    for (const paths of this.paths) paths?.setSize(width, height);
    this.touch();
  }

  /** Draws soon; see `Pace`. */
  touch() {
    this.pace?.touch();
  }

  /** Waits until a picture is there: reading a pixel does. */
  finish() {
    const gl = this.renderer.getContext();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  }

  /** @param {number} level @param {boolean} still */
  draw(level, still) {
    const { wanted, eye } = this;
    eye.controls.update();
    const fineness = level === 0 ? this.fineness : level === 1 ? 1 : COARSE;
    if (this.renderer.getPixelRatio() !== fineness) this.renderer.setPixelRatio(fineness);
    const { distance } = eye;
    const shown = this.pathsOf(level);
    if (still && shown.segments.length > 2 * MOST_WIDE) this.lookNear();
    for (const paths of this.paths) if (paths) paths.group.visible = paths === shown;
    shown.original.visible = wanted.original;
    shown.written.visible = wanted.written;
    if (this.near.original) this.near.original.visible = wanted.original;
    if (this.near.written) this.near.written.visible = wanted.written;
    // close by, the tool and the surface of its axis would stand before the eye
    shown.ribs.visible = wanted.written && wanted.axes && distance > 0.8 * this.height;
    this.tool.group.visible = wanted.tool && distance > 1.2 * this.height;
    eye.adjust();
    this.renderer.render(this.scene, eye.camera);
    if (still && this.pace.whole > PATIENT) this.fineness = 1;
  }

  /** Draws what is close to the place that is looked at as it is drawn on short paths. */
  lookNear() {
    this.near.look(this.eye.controls.target, 2 * this.eye.distance, this.colours);
    const { width, height } = this.eye.size;
    setSizes([this.near.original, this.near.written], width, height);
    if (this.near.original) this.near.original.material.color = this.gray;
  }
}

/** Whether pictures are made without a graphics card. */
function drawsInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const known = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = gl && known ? String(gl.getParameter(known.UNMASKED_RENDERER_WEBGL)) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return SOFTWARE.test(name);
}
