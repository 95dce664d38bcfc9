// The view of a recording: relative to the camera's sector, and only what is near it, like the view of a
// cluster (viewer/page_view.cc).
import {Quaternion, Vector3} from 'three';

import {drawnAs, radiusOf} from '../geometry.js';
import {between} from '../position.js';

import {positionOf, vectorOf} from './words.js';

const kNoServer = 255;  // recordings do not say which server hosts a body
const kEnd = 2;         // the phase of a contact that ends

const turned = (vector, ...orientations) =>
    orientations.reduce((v, q) => v.applyQuaternion(new Quaternion(...q)), new Vector3(...vector));

// Moves a body along its plane so that the plane's origin is its point closest to zero.
function slidToZero(local, orientation, part) {
  const normal = turned(part.normal, part.orientation, orientation);
  const origin = turned(part.position, orientation);
  const height = normal.dot(new Vector3(...local).add(origin));
  return normal.multiplyScalar(height).sub(origin).toArray();
}

// An empty frame with room for `room` bodies.
const emptyFrame = (tick, room) => ({
  kind: 'bodies',
  tick,
  count: 0,
  isKey: false,
  ids: new Float64Array(room),
  gone: [],
  positions: new Float32Array(3 * room),
  orientations: new Float32Array(4 * room),
  speeds: new Float32Array(room),
  servers: new Uint8Array(room).fill(kNoServer),
  asleep: new Uint8Array(room),
});

export class RecordedView {
  #radii = new Map();  // of shapes, in m

  // `focus` is a position of the world; only what is within `half` m of it along each axis is visible.
  constructor(recording, focus, half) {
    Object.assign(this, {recording, focus, half});
    this.origin = {sector: focus.sector, local: [0, 0, 0]};
  }

  // The sector that points are relative to, the up direction there, and the planet if there is one.
  describe() {
    const {sectorSize, gravity} = this.recording.settings;
    const view = {sector: this.focus.sector.map(String), sector_size: sectorSize};
    let up = new Vector3();
    if (gravity.case === 'centralGravity') {
      const centre = this.#offset(positionOf(gravity.value.centre));
      up = new Vector3(...this.focus.local).sub(new Vector3(...centre));
      view.planet = {centre, radius: gravity.value.radius};
    } else {
      up = new Vector3(...vectorOf(gravity.value)).negate();
    }
    view.up = up.lengthSq() > 0 ? up.normalize().toArray() : [0, 0, 1];
    return view;
  }

  // A frame (frame.js) with the visible bodies.
  see(bodies, statics) {
    const frame = emptyFrame(bodies.tick, bodies.count + statics.count);
    for (const states of [bodies, statics]) {
      for (let n = 0; n < states.count; ++n) this.#see(states, n, frame);
    }
    frame.ids = frame.ids.subarray(0, frame.count);
    return frame;
  }

  // A frame with the visible contacts of a tessera.v1.ContactBatch that have not ended.
  seeContacts(tick, contacts) {
    const seen = contacts.map((contact) => ({...contact, local: this.#offset(positionOf(contact.position))}))
                     .filter(({phase, local}) => phase !== kEnd && this.#reaches(local, 0));
    return {
      kind: 'contacts',
      tick,
      count: seen.length,
      positions: Float32Array.from(seen.flatMap(({local}) => local)),
      normals: Float32Array.from(seen.flatMap(({normal}) => vectorOf(normal))),
      impulses: Float32Array.from(seen, ({impulse}) => impulse),
    };
  }

  #see(states, n, frame) {
    const info = this.recording.bodies.get(states.ids[n]);
    if (!info) return;
    const [part, ...others] = this.recording.shapes.get(info.shape);
    const orientation = states.orientations.subarray(4 * n, 4 * n + 4);
    let local = this.#offset(states.positionOf(n));
    if (part.kind === 'plane' && others.length === 0)
      local = slidToZero(local, orientation, part);
    else if (!this.#reaches(local, info.motion === 'static' ? this.#radius(info.shape) : 0))
      return;
    const at = frame.count++;
    frame.ids[at] = info.id;
    frame.positions.set(local, 3 * at);
    frame.orientations.set(orientation, 4 * at);
    frame.speeds[at] = states.speeds[n];
    frame.asleep[at] = states.asleep[n];
  }

  #offset(position) { return between(this.origin, position, this.recording.settings.sectorSize); }

  #reaches(local, radius) {
    return local.every((x, axis) => Math.abs(x - this.focus.local[axis]) <= this.half + radius);
  }

  #radius(shape) {
    if (!this.#radii.has(shape)) {
      const {make, size} = drawnAs(shape, this.recording.shapes.get(shape));
      this.#radii.set(shape, radiusOf(make(), size));
    }
    return this.#radii.get(shape);
  }
}
