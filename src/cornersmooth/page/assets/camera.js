// Where the view is seen from.

/** Milliseconds of a flight to a corner. */
const FLIGHT = 450;
/** Headings from which the whole is tried. */
const HEADINGS = 16;
/** Points by which the path is fitted into the view. */
const MOST_FITTED = 6000;

class Eye {
  /** @param {HTMLCanvasElement} canvas @param {Vector[]} cloud points that `fit` brings into view @param {() => void} changed */
  constructor(canvas, cloud, changed) {
    this.cloud = cloud;
    this.changed = changed;
    this.camera = new THREE.PerspectiveCamera(30, 1, 0.1, 1000);
    this.camera.up.set(0, 0, 1);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.enableDamping = !calm();
    this.controls.dampingFactor = 0.15;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener("change", changed);
    this.sphere = new THREE.Sphere().setFromPoints(cloud);
    this.sphere.radius = Math.max(this.sphere.radius, 1e-3);
    this.flight = 0;
    this.flown = false;
    this.size = { width: 1, height: 1, top: 0, bottom: 0 };
  }

  get distance() {
    return this.camera.position.distanceTo(this.controls.target);
  }

  /**
   * Size of the view and what covers it, pixels: the middle of what is free is looked at.
   * @param {{width: number, height: number, top: number, bottom: number}} size
   */
  setSize(size) {
    this.size = size;
    const { width, height, top, bottom } = size;
    this.camera.aspect = width / height;
    this.camera.setViewOffset(width, height, 0, 0.5 * (bottom - top), width, height);
  }

  /** Planes near and far enough. */
  adjust() {
    const { distance } = this;
    this.camera.near = Math.max(distance / 200, 1e-4);
    this.camera.far = distance + 6 * this.sphere.radius;
    this.camera.updateProjectionMatrix();
  }

  /** Everything into the view, from the heading from which it fills most of it. */
  fit() {
    let best = this.framing(-0.92);
    for (let k = 1; k < HEADINGS; k++) {
      const other = this.framing(-0.92 + (2 * Math.PI * k) / HEADINGS);
      if (other.distance < best.distance) best = other;
    }
    this.flyTo(best.target, best.distance, best.from);
  }

  /** How all of it is seen from a heading. @param {number} heading radians */
  framing(heading) {
    const from = new THREE.Vector3(0.91 * Math.cos(heading), 0.91 * Math.sin(heading), 0.5).normalize();
    const right = new THREE.Vector3().crossVectors(this.camera.up, from).normalize();
    const up = new THREE.Vector3().crossVectors(from, right);
    const { width, height, top, bottom } = this.size;
    const pixel = Math.tan((Math.PI / 360) * this.camera.fov) / height;
    const high = pixel * Math.max(height - top - bottom, 0.3 * height);
    const broad = pixel * width;
    const target = this.sphere.center.clone();
    const arm = new THREE.Vector3();
    let distance = 0;
    for (let round = 0; round < 3; round++) {
      // sides of the cone of sight that touch the cloud; the middle between them is looked at
      const reach = [-Infinity, -Infinity, -Infinity, -Infinity];
      for (const point of this.cloud) {
        arm.copy(point).sub(target);
        const [x, y, z] = [arm.dot(right) / broad, arm.dot(up) / high, arm.dot(from)];
        reach[0] = Math.max(reach[0], x + z);
        reach[1] = Math.max(reach[1], z - x);
        reach[2] = Math.max(reach[2], y + z);
        reach[3] = Math.max(reach[3], z - y);
      }
      target.addScaledVector(right, 0.5 * broad * (reach[0] - reach[1])).addScaledVector(up, 0.5 * high * (reach[2] - reach[3]));
      distance = 1.08 * Math.max(0.5 * (reach[0] + reach[1]), 0.5 * (reach[2] + reach[3]), 1e-3);
    }
    return { target, distance, from };
  }

  /**
   * Moves the camera so that it looks at a point.
   * @param {Vector} target @param {number} distance @param {Vector} [from] direction to look from
   */
  flyTo(target, distance, from) {
    const begin = { target: this.controls.target.clone(), position: this.camera.position.clone() };
    const way = from ? from.clone() : begin.position.clone().sub(begin.target).normalize();
    const end = target.clone().addScaledVector(way, distance);
    const still = !this.flown || calm();
    this.flown = true;
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
      this.changed();
      if (share < 1) requestAnimationFrame(step);
    };
    step();
  }

  /** Turns about the target and goes nearer or farther. @param {number} round radians @param {number} up radians @param {number} zoom factor */
  orbit(round, up, zoom) {
    this.flight++;
    const arm = this.camera.position.clone().sub(this.controls.target);
    const reach = arm.length() * zoom;
    const height = Math.min(Math.max(Math.acos(arm.z / arm.length()) + up, 0.02), Math.PI - 0.02);
    const heading = Math.atan2(arm.y, arm.x) + round;
    arm.set(Math.sin(height) * Math.cos(heading), Math.sin(height) * Math.sin(heading), Math.cos(height));
    this.camera.position.copy(this.controls.target).addScaledVector(arm, reach);
    this.changed();
  }

  /** Moves across the view, in parts of its height. @param {number} right @param {number} up */
  pan(right, up) {
    this.flight++;
    const size = 2 * this.distance * Math.tan((Math.PI / 360) * this.camera.fov);
    const [across, above] = [0, 1].map((column) => new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, column));
    const way = across.multiplyScalar(right * size).addScaledVector(above, up * size);
    this.camera.position.add(way);
    this.controls.target.add(way);
    this.changed();
  }

  /** Place on the canvas, pixels; null behind the eye. @param {Vector} point is changed */
  onCanvas(point) {
    point.project(this.camera);
    if (point.z > 1) return null;
    return [(0.5 + 0.5 * point.x) * this.size.width, (0.5 - 0.5 * point.y) * this.size.height];
  }
}

/** Points of tip and axis at cutting moves. @param {Record<string, Values>} arrays @param {number} height */
function cloudOf(arrays, height) {
  const { w_tip: tip, w_axis: axis, w_rapid: rapid } = arrays;
  const cloud = /** @type {Vector[]} */ ([]);
  const step = Math.max(1, Math.floor(rapid.length / MOST_FITTED));
  for (let i = 0; i < rapid.length; i += step) {
    if (rapid[i]) continue;
    const foot = vectorAt(tip, i);
    cloud.push(foot, foot.clone().addScaledVector(vectorAt(axis, i), height));
  }
  return cloud.length ? cloud : [new THREE.Vector3()];
}

/** Whether flights and gliding are unwanted. */
function calm() {
  return matchMedia("(prefers-reduced-motion: reduce)").matches;
}
