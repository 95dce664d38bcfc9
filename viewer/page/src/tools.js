// Click tools: select, push, spawn, cast a ray. All use the cluster's own ray cast, so a click hits the
// physical shape; of what is aboard of frames that move, they hit what is drawn.
import {Quaternion, Vector3} from 'three';

import {between, moved, placed, toJson} from './position.js';

const kRayLengthMin = 200;  // m
const kDensity = 500;       // kg/m^3

const kSpawned = {
  box: {shape: (size) => ({kind: 'box', size: [size, size, size]}), volume: (size) => size ** 3},
  ball: {shape: (size) => ({kind: 'sphere', radius: size / 2}), volume: (size) => Math.PI / 6 * size ** 3},
  barrel: {
    shape: (size) => ({kind: 'cylinder', radius: size * 0.35, length: size}),
    volume: (size) => Math.PI * (size * 0.35) ** 2 * size,
  },
};

export class Tools {
  constructor({source, picture, camera, bodies, options, notify, select, selectPlace}) {
    Object.assign(this, {source, picture, camera, bodies, options, notify, select, selectPlace});
    this.tool = 'select';
    this.speed = 3;  // m/s that a push adds
    this.size = 1;   // m, of a spawned body
    this.kind = 'box';
  }

  use(tool) {
    this.tool = tool;
    this.options.replaceChildren();
    if (tool === 'push') this.#numberOption('m/s', this.speed, 0.5, (value) => this.speed = value);
    if (tool === 'spawn') {
      const kinds = document.createElement('select');
      for (const kind of Object.keys(kSpawned))
        kinds.append(new Option(kind, kind, false, kind === this.kind));
      kinds.onchange = () => this.kind = kinds.value;
      this.options.append(kinds);
      this.#numberOption('m', this.size, 0.1, (value) => this.size = value);
    }
  }

  #numberOption(unit, value, step, change) {
    const label = document.createElement('label');
    const input = document.createElement('input');
    Object.assign(input, {type: 'number', value, step, min: step});
    input.onchange = () => change(Number(input.value) || step);
    label.append(input, unit);
    this.options.append(label);
  }

  // The hit under the pointer and the ray; `hit` is null if there is none.
  async #pick(event) {
    const {view} = this.bodies;
    const {origin, direction} = this.picture.rayThrough(this.camera, view, event);
    const length = Math.max(kRayLengthMin, 6 * this.camera.distance);
    const from = moved(placed(view), origin, view.sector_size);
    const ray = {...toJson(from), direction, length};
    const aboard = this.bodies.pickAboard(ray);
    const outside = await this.source.ask('pick', ray);
    const hit = aboard.hit && !(outside.distance < aboard.distance) ? aboard : outside;
    return {from, direction, length, hit: hit.hit ? {...hit, sector: hit.sector.map(BigInt)} : null};
  }

  async click(event) {
    if (!this.bodies.view) return;
    try {
      const ray = await this.#pick(event);
      await this[`_${this.tool}`](ray);
    } catch (error) {
      this.notify(error.message, true);
    }
  }

  _select({hit}) {
    if (hit && this.bodies.look(hit.body)?.info.motion === 'static')
      this.selectPlace(hit);
    else
      this.select(hit?.body ?? null);
  }

  async _push({hit, direction}) {
    const body = hit && this.bodies.look(hit.body);
    if (body?.info.motion !== 'dynamic') return this.notify('only dynamic bodies can be pushed');
    const {position, orientation} = hit.drawn ?? body;
    const centre = new Vector3(...body.info.centre).applyQuaternion(new Quaternion(...orientation));
    const arm = between(position, hit, this.bodies.view.sector_size);
    await this.source.ask('push', {
      body: hit.body,
      frame: this.bodies.view.frame ?? 0,
      impulse: direction.map((x) => x * this.speed * body.info.mass),
      lever: new Vector3(...arm).sub(centre).toArray(),
    });
    this.select(hit.body);
  }

  async pushUp(id) {
    const body = this.bodies.look(id);
    if (body?.info.motion !== 'dynamic') return;
    const impulse = this.camera.up.clone().multiplyScalar(2 * this.speed * body.info.mass).toArray();
    await this.source.ask('push', {body: id, frame: this.bodies.view.frame ?? 0, impulse, lever: [0, 0, 0]});
  }

  async _spawn({hit}) {
    if (!hit) return this.notify('click a surface to place the body on it');
    const {shape, volume} = kSpawned[this.kind];
    const above = hit.normal.map((x) => x * (this.size * 0.55 + 0.01));
    const place = moved(hit, above, this.bodies.view.sector_size);
    const where = hit.drawn ? this.#beside(hit, place) : toJson(place);
    const {body} = await this.source.ask(
        'spawn', {...where, shape: shape(this.size), mass: kDensity * volume(this.size)});
    this.select(body);
  }

  // A place aboard, which goes along with the body that was hit: in the frame of that body.
  #beside({body, drawn: {position, orientation}}, place) {
    const away = new Vector3(...between(position, place, this.bodies.view.sector_size));
    return {beside: body, away: away.applyQuaternion(new Quaternion(...orientation).invert()).toArray()};
  }

  _ray({from, direction, length, hit}) {
    const {view} = this.bodies;
    const start = between(placed(view), from, view.sector_size);
    const reach = hit ? hit.distance : length;
    // Starts slightly beside the eye, so that the ray is visible from the side.
    const beside = this.camera.directions().right.multiplyScalar(0.02 * this.camera.distance).toArray();
    this.picture.ray.show(start.map((x, n) => x + beside[n]), start.map((x, n) => x + direction[n] * reach));
    this.notify(
        hit ? `${hit.name} at ${hit.distance.toFixed(3)} m` : `nothing within ${length.toFixed(0)} m`);
  }
}
