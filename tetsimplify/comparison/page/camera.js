// Where a view is seen from. The scene is the ball of radius 1 around the origin.

const ANGLE = Math.tan((30 / 2) * (Math.PI / 180));
const CLOSEST = 1e-4, FARTHEST = 12;

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const along = (a, t, b) => [a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]];
const length = (a) => Math.hypot(...a);
const unit = (a) => a.map((x) => x / (length(a) || 1));

class Camera {
  constructor() { this.showAll(); }

  showAll() {
    this.lookFrom([0.55, -0.75, 0.38], [0, 0, 1]);
    this.target = [0, 0, 0];
    this.distance = 1.06 / Math.sin(Math.atan(ANGLE));
  }

  copy() { return Object.assign(new Camera(), structuredClone({ ...this })); }

  /** Look along a direction, given towards the eye, with `up` upwards as far as possible. */
  lookFrom(towardsEye, up) {
    this.towardsEye = unit(towardsEye);
    const right = cross(up, this.towardsEye);
    this.right = unit(length(right) > 1e-3 ? right : cross([0.3, 1, 0.2], this.towardsEye));
    this.up = cross(this.towardsEye, this.right);
  }

  /** Turn by angles: to the right, and upwards. */
  turn(horizontal, vertical) {
    const eye = unit(along(along(this.towardsEye, -Math.tan(horizontal), this.right), Math.tan(vertical), this.up));
    const right = along(this.right, -dot(this.right, eye), eye);
    this.towardsEye = eye;
    this.right = unit(right);
    this.up = cross(eye, this.right);
  }

  /** Move what is seen to the right and down, by parts of the height of the view. */
  move(x, y) {
    const height = 2 * ANGLE * this.distance;
    this.target = along(along(this.target, -x * height, this.right), y * height, this.up);
  }

  zoom(factor) { this.distance = Math.min(Math.max(this.distance * factor, CLOSEST), FARTHEST); }

  /** Matrices by columns: from the scene to the eye, and from the eye to the screen. */
  matrices(aspect) {
    const { right, up, towardsEye, target, distance } = this;
    const toEye = [0, 1, 2].flatMap((k) => [right[k], up[k], towardsEye[k], 0]);
    toEye.push(-dot(right, target), -dot(up, target), -dot(towardsEye, target) - distance, 1);
    const reach = length(target) + 1.1;
    const near = Math.max(distance - reach, distance * 0.03), far = distance + reach;
    const narrow = ANGLE * Math.max(1, 1 / aspect);
    const toScreen = [
      1 / (narrow * aspect), 0, 0, 0, 0, 1 / narrow, 0, 0,
      0, 0, -(far + near) / (far - near), -1, 0, 0, (-2 * far * near) / (far - near), 0,
    ];
    return { toEye, toScreen };
  }
}
