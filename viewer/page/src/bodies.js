// The bodies in view, with their poses from the frames. One draw call for each kind of shape and level of
// detail.
import {Group, Matrix3, Mesh, Quaternion, Raycaster, Vector3} from 'three';

import {meshBatch, pointBatch} from './batch.js';
import {uniforms} from './body_material.js';
import {colourOf} from './colours.js';
import {asTrigger, drawnAs, kPointLevel, levelFor, meanColourOf, meanRadiusOf, radiusOf} from './geometry.js';
import {between, fromJson, moved, placed, toJson} from './position.js';

export const kPointPixels = 5;  // bodies of a smaller radius are drawn as points

export class Bodies {
  #known = new Map();   // id -> description from the server
  #shapes = new Map();  // shape id -> {parts, drawn, radius, pointRadius, colour}
  #looks = new Map();   // look id -> likewise: what is drawn of a body in the place of its shape
  #batches = new Map();  // by geometry and level of detail
  #forms = new Map();  // geometries by key, for drawing a body a second time
  #shown = new Map();  // id -> {batch, slot, shape, level, info, speed, server, isAsleep, isAboard}
  #moved = new Set();  // batches with motion in the last frame
  #mode = 'server';
  #selected = null;

  constructor() {
    this.group = new Group();
    this.view = null;  // {sector, sector_size, ...}: positions are relative to its sector
    this.tick = 0;
    this.frameMs = 33;  // between frames, smoothed
    this.pointPixels = kPointPixels;
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
    uniforms.uLooks.value = mode === 'look' ? 1 : 0;
    this.repaint();
  }
  repaint() {
    for (const [id, body] of this.#shown) this.#paint(id, body);
  }
  set selected(id) {
    const before = this.#selected;
    this.#selected = id;
    for (const changed of [before, id]) {
      if (this.#shown.has(changed)) this.#paint(changed, this.#shown.get(changed));
    }
  }

  // For a new world.
  clear() {
    for (const id of [...this.#shown.keys()]) this.#remove(id);
    for (const batch of this.#batches.values()) this.group.remove(batch.object);
    this.#known.clear();
    this.#shapes.clear();
    this.#looks.clear();
    this.#batches.clear();
    this.#forms.clear();
    this.#moved.clear();
  }

  introduce({bodies, shapes, looks = {}}) {
    for (const [id, parts] of Object.entries(shapes)) this.#shapes.set(Number(id), this.#formed(`shape ${id}`, parts));
    for (const [id, parts] of Object.entries(looks)) this.#looks.set(Number(id), this.#formed(`look ${id}`, parts));
    for (const body of bodies) this.#known.set(body.id, body);
  }
  // The id of a body in view that is ground without an end, or null.
  get ground() {
    for (const [id, {parts}] of this.#shown) {
      if (parts.some(({kind}) => kind === 'ground')) return id;
    }
    return null;
  }
  get hasLooks() { return this.#looks.size > 0; }

  #formed(name, parts) {
    const drawn = drawnAs(name, parts);
    const form = this.#form(drawn);
    const [radius, pointRadius] = [radiusOf(form, drawn.size), meanRadiusOf(form, drawn.size)];
    return {parts, drawn, radius, pointRadius, colour: meanColourOf(parts)};
  }

  // The positions of a key frame are relative to `view`.
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

  // Interpolates between the last two frames.
  blend(now) { uniforms.uBlend.value = Math.min((now - this.#arrived) / this.frameMs, 1); }

  // Whether bodies are drawn where they are in the last frame.
  get isBlended() { return uniforms.uBlend.value === 1; }

  // Chooses the level of detail of each body for a picture `height` pixels high.
  prepare({position: eye, fov}, height) {
    uniforms.uHeight.value = height;
    const pixels = height / 2 / Math.tan(fov * Math.PI / 360);  // per metre at a distance of 1 m
    for (const [id, body] of this.#shown) {
      const {shape: {drawn, radius}, batch: {position1}, slot} = body;
      if (body.info.motion === 'static') continue;
      const at = 3 * slot;
      const distance =
          Math.hypot(position1[at] - eye.x, position1[at + 1] - eye.y, position1[at + 2] - eye.z);
      const point = drawn.isTrigger ? 0 : this.pointPixels;
      const level = levelFor(drawn, pixels * radius / Math.max(distance, radius), point);
      if (level === body.level) continue;
      this.#draw(id, body, level);
      if (body.shape.colour) this.#paint(id, body);  // a point has the mean of its colours
    }
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
    body.isAboard = frame.aboard?.[n] === 1;
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
    const form = info && this.#shapes.get(info.shape);
    if (!form) return null;
    const drawn = this.#looks.get(info.look) ?? form;
    const isTrigger = info.trigger || form.parts.every(({trigger}) => trigger);
    const shape = isTrigger ? {...drawn, drawn: asTrigger(drawn.drawn)} : drawn;
    const body = {shape, parts: form.parts, info, speed: 0, server: 0, isAsleep: false};
    this.#draw(id, body, info.motion === 'static' || isTrigger ? 0 : kPointLevel);
    this.#shown.set(id, body);
    return body;
  }

  // Moves the body to the batch of this level of detail.
  #draw(id, body, level) {
    const {batch: before, slot: slotBefore, shape: {drawn, pointRadius}} = body;
    const batch = this.#batch(drawn, level);
    const slot = batch.add(id);
    batch.setSize(slot, level === kPointLevel ? [pointRadius, pointRadius, pointRadius] : drawn.size);
    if (before) {
      batch.copy(slot, before, slotBefore);
      this.#free(before, slotBefore);
      if (this.#moved.has(before)) this.#moved.add(batch);
    }
    Object.assign(body, {level, batch, slot});
  }

  #batch(drawn, level) {
    const key = level === kPointLevel ? 'points' : `${drawn.key} ${level}`;
    if (!this.#batches.has(key)) {
      const batch = level === kPointLevel ? pointBatch() : meshBatch(drawn, level);
      this.#batches.set(key, batch);
      this.group.add(batch.object);
    }
    return this.#batches.get(key);
  }

  #free(batch, slot) {
    const other = batch.remove(slot);
    if (other !== undefined) this.#shown.get(other).slot = slot;
  }

  #remove(id) {
    const body = this.#shown.get(id);
    if (!body) return;
    this.#shown.delete(id);
    this.#free(body.batch, body.slot);
  }

  // The sector of a body, relative to the sector of the view.
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
    const share = id === this.#selected ? 0.65 : 0;
    const {batch, slot, level, shape: {colour}} = body;
    // Where a look has colours of its own, what is left to say is how far it is lit up.
    const isLook = this.#mode === 'look' && colour !== null;
    const [r, g, b] = !isLook ? colourOf(this.#mode, {isStatic, server, sector, speed, isAsleep}) :
        level === kPointLevel ? colour :
                                [0, 0, 0];
    batch.tint[4 * slot] = r + (255 - r) * share;
    batch.tint[4 * slot + 1] = g + (255 - g) * share;
    batch.tint[4 * slot + 2] = b + (255 - b) * share;
    batch.tint[4 * slot + 3] = isStatic && !isLook ? 255 : 0;
    batch.touch('tint');
  }

  // Description and state of a body, with its position relative to the sector of the view (m); null if it is
  // not in view.
  look(id) {
    const body = this.#shown.get(id);
    if (!body) return null;
    const {batch, slot, parts, info, speed, server, isAsleep, isAboard} = body;
    const local = [...batch.position1.subarray(3 * slot, 3 * slot + 3)];
    const orientation = [...batch.rotation1.subarray(4 * slot, 4 * slot + 4)];
    return {
      id,
      info,
      parts,
      speed,
      server,
      isAsleep,
      isAboard,
      position: placed(this.view, local),
      orientation
    };
  }

  // What a body is drawn as: a geometry, its size along each axis, and its bounding radius (m); null if it is
  // not in view.
  formOf(id) {
    const body = this.#shown.get(id);
    if (!body) return null;
    const {drawn, radius} = body.shape;
    return {geometry: this.#form(drawn), size: drawn.size, radius};
  }

  #form(drawn) {
    if (!this.#forms.has(drawn.key)) this.#forms.set(drawn.key, drawn.make());
    return this.#forms.get(drawn.key);
  }

  // The first body that a ray hits where it is drawn, in the format of the server's answer to "pick". For
  // recordings, which have no server.
  pick(ray) { return this.#pickAmong(this.#shown.keys(), ray); }

  // The same among bodies of other frames than the view's, which the rays of that do not meet. Until the server had
  // looked for them, they would have moved on, too: so the hit has where the body is drawn.
  pickAboard(ray) {
    const isSolid = ([, {isAboard, shape}]) => isAboard && !shape.drawn.isTrigger;
    const hit = this.#pickAmong([...this.#shown].filter(isSolid).map(([id]) => id), ray);
    if (!hit.hit) return hit;
    const {place, turn} = this.#drawnPose(this.#shown.get(hit.body));
    return {...hit, drawn: {position: placed(this.view, place.toArray()), orientation: turn.toArray()}};
  }

  #pickAmong(ids, {direction, length, ...from}) {
    const origin = between(this.#origin, fromJson(from), this.view.sector_size);
    const caster = new Raycaster(new Vector3(...origin), new Vector3(...direction).normalize(), 0, length);
    const mesh = new Mesh();
    let first = null;
    for (const id of ids) {
      const {geometry, size} = this.formOf(id);
      const {place, turn} = this.#drawnPose(this.#shown.get(id));
      mesh.geometry = geometry;
      mesh.matrixWorld.compose(place, turn, new Vector3(...size));
      const [hit] = caster.intersectObject(mesh);
      if (!hit || first?.distance <= hit.distance) continue;
      const normal = hit.face.normal.clone().applyNormalMatrix(new Matrix3().getNormalMatrix(mesh.matrixWorld));
      first = {id, distance: hit.distance, point: hit.point, normal};
    }
    if (!first) return {hit: false};
    const {id, distance, point, normal} = first;
    const place = moved(this.#origin, point.toArray(), this.view.sector_size);
    const {name} = this.#known.get(id);
    return {hit: true, body: id, name, distance, normal: normal.toArray(), ...toJson(place)};
  }

  // Where the picture has a body; null if it is not in view.
  drawnPlace(id) {
    const body = this.#shown.get(id);
    return body ? placed(this.view, this.#drawnPose(body).place.toArray()) : null;
  }

  // Between the last two frames, as the picture has it.
  #drawnPose({batch: {position0, position1, rotation0, rotation1}, slot}) {
    const share = uniforms.uBlend.value;
    const place = (positions) => new Vector3().fromArray(positions, 3 * slot);
    const turn = (rotations) => new Quaternion().fromArray(rotations, 4 * slot);
    return {
      place: place(position0).lerp(place(position1), share),
      turn: turn(rotation0).slerp(turn(rotation1), share),
    };
  }

  get #origin() { return placed(this.view); }

  // Sectors with movable bodies, as {offset, server, bodies}.
  occupiedSectors() {
    const sectors = new Map();
    for (const body of this.#moving()) {
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

  // The movable bodies in view in this sector: their number, how many are awake, the highest speed (m/s), and
  // their server.
  inSector(sector) {
    const key = sector.map((index, axis) => index - this.view.sector[axis]).join();
    const there = [...this.#moving()].filter((body) => this.#sectorOffset(body).join() === key);
    return {
      count: there.length,
      awake: there.filter((body) => !body.isAsleep).length,
      fastest: there.reduce((speed, body) => Math.max(speed, body.speed), 0),
      server: there[0]?.server,
    };
  }

  * #moving() {
    for (const body of this.#shown.values()) {
      if (body.info.motion !== 'static') yield body;
    }
  }
}
