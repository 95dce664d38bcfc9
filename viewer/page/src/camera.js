// A camera that orbits a point of the world, the focus, and moves with it: drag to turn, drag with the right
// button (or Shift) to move, wheel to zoom, W A S D Q E to fly.
import {PerspectiveCamera, Quaternion, Vector3} from 'three';

import {between, moved} from './position.js';

const kDistanceMin = 0.3;
const kDistanceMax = 1e8;
const kClickPixels = 4;
const kPitchMax = 1.55;

export class Camera {
  constructor(canvas) {
    this.three = new PerspectiveCamera(50, 1, 0.1, 1000);
    this.focus = null;  // a position
    this.sectorSize = 128;
    this.yaw = -2.2;
    this.pitch = 0.35;
    this.distance = 30;
    this.up = new Vector3(0, 0, 1);
    this.onClick = () => {};
    this.onMove = () => {};  // called when the user moves the camera
    this.#keys = new Set();
    this.#listen(canvas);
  }
  #keys;
  #left = null;  // m, from the place that it rides along with to the focus

  // Rotates the z axis to the local up direction.
  #frame() { return new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), this.up); }

  // Unit vectors in the axes of the view: from the focus to the eye, right, and forward along the ground.
  directions() {
    const frame = this.#frame();
    const out = new Vector3(
                    Math.cos(this.pitch) * Math.cos(this.yaw), Math.cos(this.pitch) * Math.sin(this.yaw),
                    Math.sin(this.pitch))
                    .applyQuaternion(frame);
    const right = new Vector3().crossVectors(this.up, out).normalize();
    const forward = new Vector3().crossVectors(this.up, right).normalize();
    return {out, right, forward};
  }

  jump(focus, distance) {
    this.focus = focus;
    if (distance) this.distance = Math.min(Math.max(distance, kDistanceMin), kDistanceMax);
    this.#left = null;
  }

  // In each picture, of a place that moves: the focus moves with it, and what is left of the way there fades.
  ride(place) {
    this.#left ??= between(place, this.focus, this.sectorSize);
    if (Math.hypot(...this.#left) > 50 * this.distance) this.#left = [0, 0, 0];
    this.focus = moved(place, this.#left, this.sectorSize);
  }

  stopRiding() { this.#left = null; }

  advance(seconds) {
    if (!this.focus) return;
    this.#left &&= this.#left.map((x) => x * Math.exp(-9 * seconds));
    const {right, forward} = this.directions();
    const way = new Vector3();
    const along = (key, direction, sign) => this.#keys.has(key) && way.addScaledVector(direction, sign);
    along('w', forward, 1);
    along('s', forward, -1);
    along('d', right, 1);
    along('a', right, -1);
    along('e', this.up, 1);
    along('q', this.up, -1);
    if (way.lengthSq() > 0) {
      this.#moveByHand(way.normalize().multiplyScalar(1.2 * this.distance * seconds));
    }
  }

  // Places the three.js camera, in metres from the centre of `sector`.
  place(sector, aspect, reach) {
    const target = new Vector3(...between({sector, local: [0, 0, 0]}, this.focus, this.sectorSize));
    const {out} = this.directions();
    this.three.up.copy(this.up);
    this.three.position.copy(target).addScaledVector(out, this.distance);
    this.three.lookAt(target);
    this.three.aspect = aspect;
    this.three.near = Math.max(0.05, this.distance / 100);
    this.three.far = reach;
    this.three.updateProjectionMatrix();
    this.three.updateMatrixWorld();
    return target;
  }

  #moveByHand(way) {
    this.#left = null;
    this.focus = moved(this.focus, way.toArray(), this.sectorSize);
    this.onMove();
  }

  #drag(event) {
    const {movementX: x, movementY: y} = event;
    if (event.buttons === 1 && !event.shiftKey) {
      this.yaw -= x * 0.006;
      this.pitch = Math.min(Math.max(this.pitch + y * 0.006, -kPitchMax), kPitchMax);
    } else if (event.buttons) {
      const {right, out} = this.directions();
      const up = new Vector3().crossVectors(out, right);
      const scale = this.distance * 0.0016;
      this.#moveByHand(right.multiplyScalar(-x * scale).addScaledVector(up, y * scale));
    }
  }

  #listen(canvas) {
    let pressed = null;
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      canvas.focus();
      pressed = {x: event.clientX, y: event.clientY, isClick: event.button === 0};
    });
    canvas.addEventListener('pointermove', (event) => {
      if (!pressed) return;
      if (Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) > kClickPixels)
        pressed.isClick = false;
      if (!pressed.isClick) this.#drag(event);
    });
    canvas.addEventListener('pointerup', (event) => {
      if (pressed?.isClick) this.onClick(event);
      pressed = null;
    });
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      const step = Math.min(Math.max(event.deltaY, -240), 240);
      this.distance = Math.min(Math.max(this.distance * Math.exp(step * 0.0015), kDistanceMin), kDistanceMax);
    }, {passive: false});
    canvas.addEventListener('keydown', ({key}) => this.#keys.add(key.toLowerCase()));
    canvas.addEventListener('keyup', ({key}) => this.#keys.delete(key.toLowerCase()));
    canvas.addEventListener('blur', () => this.#keys.clear());
  }
}
