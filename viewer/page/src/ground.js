// Ground without an end, as rays of the cluster find it around the camera.
import {
  BufferAttribute, BufferGeometry, DoubleSide, Group, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial,
} from 'three';

import {between, isSameFrame, placed, toJson} from './position.js';

const kHalfMin = 60;  // m
const kHalfMax = 4000;
const kRetryMs = 500;

const kHalfOf = (distance) => Math.min(Math.max(6 * distance, kHalfMin), kHalfMax);

// Triangles between points of a square grid, and its lines; none at points that are null.
export function meshOf(side, points) {
  const has = (n) => points[3 * n] !== null;
  const [triangles, lines] = [[], []];
  for (let row = 0; row < side; ++row) {
    for (let column = 0; column < side; ++column) {
      const [a, b, c, d] = [0, 1, side, side + 1].map((step) => row * side + column + step);
      const [toRight, toNext] = [column + 1 < side && has(a) && has(b), row + 1 < side && has(a) && has(c)];
      if (toRight) lines.push(a, b);
      if (toNext) lines.push(a, c);
      if (toRight && toNext && has(d)) triangles.push(a, b, c, b, d, c);
    }
  }
  return {positions: Float32Array.from(points, (x) => x ?? 0), triangles, lines};
}

export class Ground {
  #shown = null;  // {centre, half}
  #isAsking = false;
  #askedAt = 0;

  // `ask(what, details)` promises an answer; `changed()` is called after one.
  constructor(ask, changed) {
    Object.assign(this, {ask, changed});
    const offset = {polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1};  // behind the lines
    this.surface = new Mesh(new BufferGeometry(), new MeshLambertMaterial({side: DoubleSide, ...offset}));
    this.lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({transparent: true, opacity: 0.5}));
    this.object = new Group();
    this.object.add(this.surface, this.lines);
    for (const part of [this.surface, this.lines]) part.frustumCulled = false;
    this.surface.receiveShadow = true;
    this.object.visible = false;
  }

  use({still, groundNet}) {
    this.surface.material.color.set(still);
    this.lines.material.color.set(groundNet);
  }

  clear() {
    this.#shown = null;
    this.object.visible = false;
  }

  // Asks where the camera has left what is shown; `body` is the id of the ground, or null.
  lookAround(body, {focus, distance, sectorSize}) {
    if (body === null || !focus) return this.clear();
    const half = kHalfOf(distance);
    const isEnough = this.#shown && isSameFrame(this.#shown.centre, focus) && half < 2 * this.#shown.half && half > this.#shown.half / 3 &&
        Math.hypot(...between(this.#shown.centre, focus, sectorSize)) < this.#shown.half / 6;
    if (isEnough || this.#isAsking || performance.now() - this.#askedAt < kRetryMs) return;
    this.#request(body, focus, half);
  }

  async #request(body, centre, half) {
    this.#isAsking = true;
    this.#askedAt = performance.now();
    const answer = await this.ask('ground', {...toJson(centre), half, body}).catch(() => null);  // the next time
    this.#isAsking = false;
    if (!answer) return;
    const {positions, triangles, lines} = meshOf(answer.side, answer.points);
    const points = new BufferAttribute(positions, 3);
    for (const [part, indices] of [[this.surface, triangles], [this.lines, lines]]) {
      part.geometry.dispose();
      part.geometry = new BufferGeometry().setAttribute('position', points);
      part.geometry.setIndex(indices);
    }
    this.surface.geometry.computeVertexNormals();
    this.#shown = {centre, half};
    this.changed();
  }

  // Where it is in the view, whose centre of a sector is the origin.
  place(view) {
    this.object.visible = this.#shown !== null && isSameFrame(this.#shown.centre, view);
    if (!this.object.visible) return;
    this.object.position.set(...between(placed(view), placed(this.#shown.centre), view.sector_size));
  }
}
