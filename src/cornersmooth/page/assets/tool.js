// The tool as a body that is turned on a lathe.

class ToolBody {
  /** @param {ToolShape[]} tools @param {number} height of a plain body where no tool is described */
  constructor(tools, height) {
    this.tools = tools;
    this.height = height;
    this.shape = -1;
    this.group = new THREE.Group();
  }

  /** Puts the tool somewhere. @param {number} shape number of the tool @param {number[]} tip @param {number[]} axis */
  place(shape, tip, axis) {
    if (shape !== this.shape) this.build(shape);
    this.group.position.set(tip[0], tip[1], tip[2]);
    const lean = new THREE.Vector3(axis[0], axis[1], axis[2]).normalize();
    this.group.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), lean);
  }

  /** @param {number} shape */
  build(shape) {
    this.shape = shape;
    this.group.clear();
    const outline = this.tools[shape]?.outline ?? [[0, 0], [0.06 * this.height, 0.25 * this.height], [0.06 * this.height, this.height]];
    const closed = [...outline, [0, outline[outline.length - 1][1]]].map(([r, h]) => new THREE.Vector2(r, h));
    const body = new THREE.LatheGeometry(closed, 48);
    body.rotateX(Math.PI / 2);
    const look = { color: 0x9fb4c8, metalness: 0.35, roughness: 0.45, transparent: true, opacity: 0.42, side: THREE.DoubleSide, depthWrite: false };
    const mesh = new THREE.Mesh(body, new THREE.MeshStandardMaterial(look));
    mesh.renderOrder = 3;
    this.group.add(mesh);
  }
}
