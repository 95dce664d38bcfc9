// Bodies drawn in one call: all with the same geometry, or all as points.
import {BufferAttribute, BufferGeometry, DynamicDrawUsage, InstancedBufferAttribute, InstancedBufferGeometry, Mesh, Points,} from 'three';

import {bodyMaterial, pointMaterial, pointShadowMaterial, shadowMaterial} from './body_material.js';

const kSlotsFirst = 64;
const kFields = {
  position0: 3,
  position1: 3,
  rotation0: 4,
  rotation1: 4,
  size: 3,
  tint: 4
};

class Batch {
  #Attribute;

  constructor(object, Attribute) {
    this.object = object;
    this.#Attribute = Attribute;
    this.count = 0;
    this.owners = [];        // id of the body in each slot
    this.dirty = new Set();  // names of fields
    this.#reserve(kSlotsFirst);
    object.frustumCulled = false;
    object.castShadow = object.receiveShadow = true;
  }

  get #geometry() {
    return this.object.geometry;
  }

  #reserve(slots) {
    this.capacity = slots;
    for (const [name, width] of Object.entries(kFields)) {
      const values = name === 'tint' ? new Uint8Array(width * slots) : new Float32Array(width * slots);
      if (this[name]) values.set(this[name]);
      this[name] = values;
      const attribute = new this.#Attribute(values, width, name === 'tint');
      attribute.setUsage(DynamicDrawUsage);
      this.#geometry.setAttribute(name, attribute);
    }
    this.#geometry.dispose();
  }

  #resize(count) {
    this.count = count;
    if (this.object.isPoints)
      this.#geometry.setDrawRange(0, count);
    else
      this.#geometry.instanceCount = count;
  }

  // Returns the slot of the new body.
  add(id) {
    if (this.count === this.capacity) this.#reserve(2 * this.capacity);
    const slot = this.count;
    this.owners[slot] = id;
    this.#resize(slot + 1);
    return slot;
  }

  setSize(slot, size) {
    this.size.set(size, 3 * slot);
    this.touch('size');
  }

  // Copies the data of a body from another batch, except its size.
  copy(slot, other, otherSlot) {
    for (const [name, width] of Object.entries(kFields)) {
      if (name === 'size') continue;
      this[name].set(other[name].subarray(width * otherSlot, width * (otherSlot + 1)), width * slot);
      this.touch(name);
    }
  }

  // The last body moves into the freed slot. Returns its id, or undefined if it was the one removed.
  remove(slot) {
    const last = this.count - 1;
    for (const [name, width] of Object.entries(kFields)) {
      this[name].copyWithin(width * slot, width * last, width * (last + 1));
      this.touch(name);
    }
    this.#resize(last);
    const id = this.owners[last];
    this.owners[slot] = id;
    return slot === last ? undefined : id;
  }

  touch(name) {
    this.dirty.add(name);
  }

  // Uploads the dirty fields to the graphics card.
  flush() {
    for (const name of this.dirty) {
      const attribute = this.#geometry.attributes[name];
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, this.count * kFields[name]);
      attribute.needsUpdate = true;
    }
    this.dirty.clear();
  }

  // The current poses become the start of the next interpolation.
  advance() {
    this.position0.set(this.position1.subarray(0, 3 * this.count));
    this.rotation0.set(this.rotation1.subarray(0, 4 * this.count));
    this.touchPoses();
  }

  touchPoses() {
    for (const name of ['position0', 'position1', 'rotation0', 'rotation1']) this.touch(name);
  }
}

export function meshBatch({make, isBox, hasColours, isTrigger = false}, level) {
  const shape = make(level);
  const geometry = new InstancedBufferGeometry();
  for (const [name, attribute] of Object.entries(shape.attributes)) geometry.setAttribute(name, attribute);
  geometry.setIndex(shape.index);
  const mesh = new Mesh(geometry, bodyMaterial(isBox, hasColours, isTrigger));
  mesh.customDepthMaterial = shadowMaterial();
  const batch = new Batch(mesh, InstancedBufferAttribute);
  if (isTrigger) mesh.castShadow = mesh.receiveShadow = false;
  return batch;
}

// Bodies a few pixels across, each drawn as a ball of radius size[0] from a single vertex.
export function pointBatch() {
  const points = new Points(new BufferGeometry(), pointMaterial());
  points.customDepthMaterial = pointShadowMaterial();
  return new Batch(points, BufferAttribute);
}
