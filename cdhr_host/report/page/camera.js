// A camera that turns about a place; lengths in mm, z up.
const FIELD = (32 * Math.PI) / 180;

class Camera {
  constructor(box) {
    this.box = box;
    this.home();
  }

  home() {
    const { low, high } = this.box;
    this.target = low.map((each, k) => (each + high[k]) / 2);
    this.radius = Math.max(Math.hypot(...low.map((each, k) => high[k] - each)) / 2, 5);
    this.distance = this.fitted(this.radius);
    this.yaw = -0.9;
    this.pitch = 0.55;
  }

  // far enough for a ball of this radius to fit a window of this aspect
  fitted(radius) {
    const narrow = Math.min(1, this.aspect || 1);
    return (1.08 * radius) / Math.sin(FIELD / 2) / narrow;
  }

  top() {
    this.home();
    this.yaw = -Math.PI / 2;
    this.pitch = Math.PI / 2 - 1e-3;
  }

  front() {
    this.home();
    this.yaw = -Math.PI / 2;
    this.pitch = 0.02;
  }

  turn(right, up) {
    this.yaw -= right;
    this.pitch = Math.min(Math.max(this.pitch + up, -1.55), 1.569);
  }

  zoom(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, 2), 50 * this.radius + 2000);
  }

  axes() {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    return { right: [-sy, cy, 0], up: [-sp * cy, -sp * sy, cp], back: [cp * cy, cp * sy, sp] };
  }

  // shares of the window's height
  pan(right, up) {
    const span = 2 * this.distance * Math.tan(FIELD / 2);
    const axes = this.axes();
    this.target = this.target.map((each, k) => each - span * (right * axes.right[k] + up * axes.up[k]));
  }

  // column-major 4x4: world -> clip
  matrix(aspect) {
    const { right, up, back } = this.axes();
    const eye = this.target.map((each, k) => each + this.distance * back[k]);
    const far = this.distance + 4 * this.radius + 4000, near = Math.max(this.distance / 500, 0.5);
    const f = 1 / Math.tan(FIELD / 2), depth = (far + near) / (near - far), shift = (2 * far * near) / (near - far);
    const dot = (axis) => -(axis[0] * eye[0] + axis[1] * eye[1] + axis[2] * eye[2]);
    const column = (k) => [(f / aspect) * right[k], f * up[k], depth * back[k], -back[k]];
    return new Float32Array([...column(0), ...column(1), ...column(2),
      (f / aspect) * dot(right), f * dot(up), depth * dot(back) + shift, -dot(back)]);
  }
}

// world mm -> [x, y, w] in CSS pixels; w is not positive behind the camera
function projected(matrix, place, width, height) {
  const row = (k) => matrix[k] * place[0] + matrix[4 + k] * place[1] + matrix[8 + k] * place[2] + matrix[12 + k];
  const w = row(3);
  return [(row(0) / w + 1) * width / 2, (1 - row(1) / w) * height / 2, w];
}
