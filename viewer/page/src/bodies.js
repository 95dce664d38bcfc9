// The bodies in view: their poses as the frames tell them, drawn in one call for each kind of shape.
import {
  DynamicDrawUsage, Group, InstancedBufferAttribute, InstancedBufferGeometry, Mesh, Quaternion, Raycaster,
  Vector3,
} from 'three';

import {bodyMaterial, shadowMaterial, uniforms} from './body_material.js';
import {colourOf} from './colours.js';
import {drawnAs, radiusOf} from './geometry.js';
import {between, fromJson, moved, toJson} from './position.js';

const kSlotsFirst = 64;
const kFields = {
  position0: 3,
  position1: 3,
  rotation0: 4,
  rotation1: 4,
  size: 3,
  tint: 4
};

// All bodies that are drawn with one geometry.
class Batch {
  constructor({make, isBox}) {
    this.count = 0;
    this.owners = [];        // id of the body in each slot
    this.dirty = new Set();  // names of fields
    this.geometry = new InstancedBufferGeometry();
    const shape = make();
    for (const [name, attribute] of Object.entries(shape.attributes))
      this.geometry.setAttribute(name, attribute);
    this.geometry.setIndex(shape.index);
    this.#reserve(kSlotsFirst);
    this.mesh = new Mesh(this.geometry, bodyMaterial(isBox));
    this.mesh.customDepthMaterial = shadowMaterial();
    this.mesh.frustumCulled = false;
    this.mesh.castShadow = this.mesh.receiveShadow = true;
  }

  #reserve(slots) {
    this.capacity = slots;
    for (const [name, width] of Object.entries(kFields)) {
      const values = name === 'tint' ? new Uint8Array(width * slots) : new Float32Array(width * slots);
      if (this[name]) values.set(this[name]);
      this[name] = values;
      const attribute = new InstancedBufferAttribute(values, width, name === 'tint');
      attribute.setUsage(DynamicDrawUsage);
      this.geometry.setAttribute(name, attribute);
    }
    this.geometry.dispose();
  }

  add(id, size) {
    if (this.count === this.capacity) this.#reserve(2 * this.capacity);
    const slot = this.count++;
    this.owners[slot] = id;
    this.size.set(size, 3 * slot);
    this.touch('size');
    this.geometry.instanceCount = this.count;
    return slot;
  }

  // The last one takes the place: its id, or undefined.
  remove(slot) {
    const last = --this.count;
    for (const [name, width] of Object.entries(kFields)) {
      this[name].copyWithin(width * slot, width * last, width * (last + 1));
      this.touch(name);
    }
    this.geometry.instanceCount = this.count;
    const id = this.owners[last];
    this.owners[slot] = id;
    return slot === last ? undefined : id;
  }

  touch(name) { this.dirty.add(name); }

  // Hands what has changed to the graphics card.
  flush() {
    for (const name of this.dirty) {
      const attribute = this.geometry.attributes[name];
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, this.count * kFields[name]);
      attribute.needsUpdate = true;
    }
    this.dirty.clear();
  }

  // The poses so far become those that motion starts from.
  advance() {
    this.position0.set(this.position1.subarray(0, 3 * this.count));
    this.rotation0.set(this.rotation1.subarray(0, 4 * this.count));
    this.touchPoses();
  }

  touchPoses() {
    for (const name of ['position0', 'position1', 'rotation0', 'rotation1']) this.touch(name);
  }
}

export class Bodies {
  #known = new Map();   // id -> what the server said of the body
  #shapes = new Map();  // shape id -> {parts, drawn}
  #batches = new Map();
  #forms = new Map();  // of batches: geometries by key, for those who draw a body a second time
  #shown = new Map();  // id -> {batch, slot, info, speed, server, isAsleep}
  #moved = new Set();  // batches with motion in the last frame
  #mode = 'server';
  #selected = null;

  constructor() {
    this.group = new Group();
    this.view = null;  // {sector, sector_size, ...}: where positions count from
    this.tick = 0;
    this.frameMs = 33;  // between frames, smoothed
    this.#arrived = performance.now();
  }
  #arrived;

  get count() { return this.#shown.size; }
  get ids() { return this.#shown.keys(); }
  get countMoving() {
    let count = 0;
    for (const body of this.#shown.values()) count += body.info.motion !== 'static';
    return count;
  }
  get mode() { return this.#mode; }
  set mode(mode) {
    this.#mode = mode;
    for (const [id, body] of this.#shown) this.#paint(id, body);
  }
  set selected(id) {
    const before = this.#selected;
    this.#selected = id;
    for (const changed of [before, id]) {
      if (this.#shown.has(changed)) this.#paint(changed, this.#shown.get(changed));
    }
  }

  // Another world: nothing of before counts.
  clear() {
    for (const id of [...this.#shown.keys()]) this.#remove(id);
    for (const batch of this.#batches.values()) this.group.remove(batch.mesh);
    this.#known.clear();
    this.#shapes.clear();
    this.#batches.clear();
    this.#forms.clear();
    this.#moved.clear();
  }

  introduce({bodies, shapes}) {
    for (const [id, parts] of Object.entries(shapes))
      this.#shapes.set(Number(id), {parts, drawn: drawnAs(id, parts)});
    for (const body of bodies) this.#known.set(body.id, body);
  }

  // `view` is where the positions of a key frame count from.
  apply(frame, view) {
    const now = performance.now();
    this.frameMs += 0.2 * (Math.min(now - this.#arrived, 200) - this.frameMs);
    this.#arrived = now;
    this.tick = frame.tick;
    if (frame.isKey) {
      this.view = view;
      uniforms.uSectorSize.value = view.sector_size;
      const here = new Set(frame.ids);
      for (const id of [...this.#shown.keys()]) {
        if (!here.has(id)) this.#remove(id);
      }
    }
    for (const id of frame.gone) this.#remove(id);
    for (const batch of this.#moved) batch.advance();
    this.#moved.clear();
    for (let n = 0; n < frame.count; ++n) this.#move(frame, n);
    for (const batch of this.#moved) {
      if (frame.isKey)
        batch.advance();
      else
        batch.touchPoses();
    }
  }

  // Between the last two frames, as far as time has gone.
  blend(now) {
    uniforms.uBlend.value = Math.min((now - this.#arrived) / this.frameMs, 1);
    for (const batch of this.#batches.values()) batch.flush();
  }

  #move(frame, n) {
    const id = frame.ids[n];
    const isNew = !this.#shown.has(id);
    const body = isNew ? this.#add(id) : this.#shown.get(id);
    if (!body) return;
    const {batch, slot} = body;
    const isAsleep = frame.asleep[n] === 1;
    const isRepainted = isNew || this.#mode === 'speed' || this.#mode === 'sector' ||
        body.server !== frame.servers[n] || body.isAsleep !== isAsleep;
    body.speed = frame.speeds[n];
    body.server = frame.servers[n];
    body.isAsleep = isAsleep;
    for (let axis = 0; axis < 3; ++axis) batch.position1[3 * slot + axis] = frame.positions[3 * n + axis];
    for (let axis = 0; axis < 4; ++axis) batch.rotation1[4 * slot + axis] = frame.orientations[4 * n + axis];
    if (isNew) {
      batch.position0.set(batch.position1.subarray(3 * slot, 3 * slot + 3), 3 * slot);
      batch.rotation0.set(batch.rotation1.subarray(4 * slot, 4 * slot + 4), 4 * slot);
    }
    this.#moved.add(batch);
    if (isRepainted) this.#paint(id, body);
  }

  #add(id) {
    const info = this.#known.get(id);
    const shape = info && this.#shapes.get(info.shape);
    if (!shape) return null;
    const {key, size} = shape.drawn;
    if (!this.#batches.has(key)) {
      const batch = new Batch(shape.drawn);
      this.#batches.set(key, batch);
      this.group.add(batch.mesh);
    }
    const batch = this.#batches.get(key);
    const body = {batch, slot: batch.add(id, size), info, speed: 0, server: 0, isAsleep: false};
    this.#shown.set(id, body);
    return body;
  }

  #remove(id) {
    const body = this.#shown.get(id);
    if (!body) return;
    this.#shown.delete(id);
    const other = body.batch.remove(body.slot);
    if (other !== undefined) this.#shown.get(other).slot = body.slot;
  }

  // The sector of a body, in sectors from that of the view.
  #sectorOffset({batch, slot}) {
    const size = this.view.sector_size;
    return [0, 1, 2].map((axis) => Math.floor(batch.position1[3 * slot + axis] / size + 0.5));
  }

  #paint(id, body) {
    const isStatic = body.info.motion === 'static';
    const {speed, server, isAsleep} = body;
    const low = this.view.low;
    const sector =
        this.#mode === 'sector' ? this.#sectorOffset(body).map((offset, axis) => offset + low[axis]) : null;
    const [r, g, b] = colourOf(this.#mode, {isStatic, server, sector, speed, isAsleep});
    const share = id === this.#selected ? 0.65 : 0;
    const {batch, slot} = body;
    batch.tint[4 * slot] = r + (255 - r) * share;
    batch.tint[4 * slot + 1] = g + (255 - g) * share;
    batch.tint[4 * slot + 2] = b + (255 - b) * share;
    batch.tint[4 * slot + 3] = isStatic ? 255 : 0;
    batch.touch('tint');
  }

  // What is known and shown of a body, with its place in metres from the sector of the view; null if it is
  // not in view.
  look(id) {
    const body = this.#shown.get(id);
    if (!body) return null;
    const {batch, slot, info, speed, server, isAsleep} = body;
    const local = [...batch.position1.subarray(3 * slot, 3 * slot + 3)];
    const orientation = [...batch.rotation1.subarray(4 * slot, 4 * slot + 4)];
    const {parts} = this.#shapes.get(info.shape);
    return {
      id,
      info,
      parts,
      speed,
      server,
      isAsleep,
      position: {sector: this.view.sector, local},
      orientation
    };
  }

  // What a body is drawn as: a geometry, its size along each axis, and the radius (m) of a ball that holds it; null if
  // it is not in view.
  formOf(id) {
    const body = this.#shown.get(id);
    if (!body) return null;
    const {drawn} = this.#shapes.get(body.info.shape);
    if (!this.#forms.has(drawn.key)) this.#forms.set(drawn.key, drawn.make());
    const geometry = this.#forms.get(drawn.key);
    return {geometry, size: drawn.size, radius: radiusOf(geometry, drawn.size)};
  }

  // What is drawn first under a ray, in the words of a "pick" of the server: for worlds that only the page
  // has.
  pick({direction, length, ...from}) {
    const origin = between(this.#origin, fromJson(from), this.view.sector_size);
    const caster = new Raycaster(new Vector3(...origin), new Vector3(...direction).normalize(), 0, length);
    const hits = [...this.#shown.keys()].flatMap((id) => {
      const {geometry, size} = this.formOf(id);
      const {position, orientation} = this.look(id);
      const mesh = new Mesh(geometry);
      mesh.matrixWorld.compose(
          new Vector3(...position.local), new Quaternion(...orientation), new Vector3(...size));
      return caster.intersectObject(mesh).map(({distance, point}) => ({id, distance, point}));
    });
    if (hits.length === 0) return {hit: false};
    const {id, distance, point} = hits.reduce((a, b) => a.distance <= b.distance ? a : b);
    const place = moved(this.#origin, point.toArray(), this.view.sector_size);
    return {hit: true, body: id, name: this.#known.get(id).name, distance, ...toJson(place)};
  }

  get #origin() { return {sector: this.view.sector, local: [0, 0, 0]}; }

  // Sectors with bodies that can move: {offset, server, bodies} each.
  occupiedSectors() {
    const sectors = new Map();
    for (const body of this.#shown.values()) {
      if (body.info.motion === 'static') continue;
      const offset = this.#sectorOffset(body);
      const key = offset.join();
      const known = sectors.get(key);
      if (known)
        known.bodies += 1;
      else
        sectors.set(key, {offset, server: body.server, bodies: 1});
    }
    return [...sectors.values()];
  }
}
