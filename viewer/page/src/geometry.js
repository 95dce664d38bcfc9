// Geometries for the world's shapes; common shapes share a unit geometry, scaled for each body.
import {
  BoxGeometry, BufferAttribute, BufferGeometry, CapsuleGeometry, CylinderGeometry, Matrix4, PlaneGeometry,
  Quaternion, SphereGeometry, Vector3,
} from 'three';
import {ConvexGeometry} from 'three/addons/geometries/ConvexGeometry.js';
import {mergeGeometries} from 'three/addons/utils/BufferGeometryUtils.js';

const kPlaneHalf = 5e4;     // m: beyond what can be seen
const kPlaneParts = 32;     // along each side, smaller towards the middle
const kPlaneGrowth = 2000;  // size of the outermost part relative to the innermost

const triples = (flat) =>
    Array.from({length: flat.length / 3}, (_, n) => new Vector3(...flat.slice(3 * n, 3 * n + 3)));

// Cylinders and capsules have their axis along z in Tessera, along y in three.js.
const alongZ = (geometry) => geometry.rotateX(Math.PI / 2);

function heightField({columns, rows, spacing, heights}) {
  const geometry =
      new PlaneGeometry((columns - 1) * spacing[0], (rows - 1) * spacing[1], columns - 1, rows - 1);
  const points = geometry.attributes.position;
  for (let row = 0; row < rows; ++row) {
    for (let column = 0; column < columns; ++column) {
      points.setZ((rows - 1 - row) * columns + column, heights[row * columns + column]);
    }
  }
  geometry.computeVertexNormals();
  return geometry;
}

function mesh({vertices, indices}) {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(vertices), 3));
  geometry.setIndex(indices);
  const flat = geometry.toNonIndexed();
  flat.computeVertexNormals();
  return flat;
}

// Subdivided: the depth values of a single triangle of that size are too coarse for bodies lying on it.
function plane({normal}) {
  const geometry = new PlaneGeometry(2, 2, kPlaneParts, kPlaneParts);
  const {array} = geometry.attributes.position;
  const spread = (x) => Math.sign(x) * kPlaneHalf * (kPlaneGrowth ** Math.abs(x) - 1) / (kPlaneGrowth - 1);
  array.forEach((x, n) => array[n] = spread(x));
  return geometry.applyQuaternion(
      new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), new Vector3(...normal)));
}

// Levels of detail of round shapes, finest first; each applies from a radius of `pixels`. The coarsest level
// is a point.
const kLevels = [
  {pixels: 48, around: 28, along: 18, cap: 8},
  {pixels: 12, around: 16, along: 10, cap: 4},
  {pixels: 0, around: 8, along: 6, cap: 3},
];
export const kPointLevel = kLevels.length;

const kUnits = {
  box: () => new BoxGeometry(1, 1, 1),
  sphere: ({around, along}) => new SphereGeometry(1, around, along),
  cylinder: ({around}) => alongZ(new CylinderGeometry(1, 1, 1, around)),
};

// Without an end, and known near bodies alone: it is not drawn.
const ground = () => mesh({vertices: [0, 0, 0, 0, 0, 0, 0, 0, 0], indices: [0, 1, 2]});

const kMakers = {
  box: ({size}) => new BoxGeometry(...size),
  sphere: ({radius}, {around, along}) => new SphereGeometry(radius, around, along),
  ellipsoid: ({radii}, {around, along}) => new SphereGeometry(1, around, along).scale(...radii),
  cylinder: ({radius, length}, {around}) => alongZ(new CylinderGeometry(radius, radius, length, around)),
  capsule: ({radius, length}, {around, cap}) => alongZ(new CapsuleGeometry(radius, length, cap, around)),
  plane,
  hull: ({points}) => new ConvexGeometry(triples(points)),
  mesh,
  heights: heightField,
  ground,
};

function sizeOf({kind, size, radius, radii, length}) {
  if (kind === 'box') return ['box', size];
  if (kind === 'sphere') return ['sphere', [radius, radius, radius]];
  if (kind === 'ellipsoid') return ['sphere', radii];
  if (kind === 'cylinder') return ['cylinder', [radius, radius, length]];
  return [null, null];
}

const isAtOrigin = ({position, orientation}) =>
    position.every((x) => x === 0) && Math.abs(orientation[3]) === 1;

function placed(part, level) {
  const geometry = kMakers[part.kind](part, level);
  const one = new Vector3(1, 1, 1);
  geometry.applyMatrix4(
      new Matrix4().compose(new Vector3(...part.position), new Quaternion(...part.orientation), one));
  const flat = geometry.index ? geometry.toNonIndexed() : geometry;
  flat.deleteAttribute('uv');
  if (part.colour !== undefined) {
    const colours = new Uint8Array(3 * flat.attributes.position.count);
    colours.forEach((_, n) => colours[n] = bytesOf(part.colour)[n % 3]);
    flat.setAttribute('colour', new BufferAttribute(colours, 3, true));
  }
  return flat;
}

const bytesOf = (colour) => [colour >> 16 & 255, colour >> 8 & 255, colour & 255];

// Of the parts of a look, three bytes; null for those of a shape.
export function meanColourOf(parts) {
  if (parts[0].colour === undefined) return null;
  const colours = parts.map(({colour}) => bytesOf(colour));
  return [0, 1, 2].map((at) => colours.reduce((sum, colour) => sum + colour[at], 0) / colours.length);
}

const isRound = ({kind}) => ['sphere', 'ellipsoid', 'cylinder', 'capsule'].includes(kind);

// {key, size, make, levels, isBox, hasColours} of a shape or look; bodies with equal keys are drawn together,
// each with its size. `make` returns the geometry of a level of detail, from 0 (the finest) to `levels` - 1.
export function drawnAs(name, parts) {
  const levels = parts.some(isRound) ? kLevels.length : 1;
  const hasColours = parts[0].colour !== undefined;
  if (parts.length === 1 && isAtOrigin(parts[0]) && !hasColours) {
    const [unit, size] = sizeOf(parts[0]);
    if (unit) {
      const make = (level = 0) => kUnits[unit](kLevels[level]);
      return {key: unit, size, make, levels, isBox: unit === 'box', hasColours};
    }
  }
  const make = (level = 0) => mergeGeometries(parts.map((part) => placed(part, kLevels[level])));
  return {key: name, size: [1, 1, 1], make, levels, isBox: false, hasColours};
}

// The same for a body that touches nothing: what it holds is seen through it, and it is never a point.
export const asTrigger = (drawn) => ({...drawn, key: `${drawn.key} trigger`, isTrigger: true});

// The level of detail of a body with a radius of `pixels`; bodies smaller than `point` are points.
export function levelFor({levels}, pixels, point) {
  if (pixels < point) return kPointLevel;
  return Math.min(kLevels.findIndex((level) => pixels >= level.pixels), levels - 1);
}

// The radius (m) of a ball around the origin that contains the geometry scaled by `size`.
export function radiusOf(geometry, size) {
  if (geometry.boundingSphere === null) geometry.computeBoundingSphere();
  const {center, radius} = geometry.boundingSphere;
  return (center.length() + radius) * Math.max(...size);
}

// The radius (m) of a ball of about the same volume.
export function meanRadiusOf(geometry, size) {
  if (geometry.boundingBox === null) geometry.computeBoundingBox();
  const edges = geometry.boundingBox.getSize(new Vector3()).toArray();
  return edges.reduce((product, edge, axis) => product * edge * size[axis] / 2, 1) ** (1 / 3);
}

const round = (x) => Number(x.toPrecision(4));

// A short description for users.
export function describe(parts) {
  if (parts.length > 1) return `${parts.length} parts`;
  const {kind, size, radius, radii, length, points, indices, columns, rows} = parts[0];
  if (kind === 'box') return `box ${size.map(round).join(' × ')} m`;
  if (kind === 'sphere') return `sphere, radius ${round(radius)} m`;
  if (kind === 'ellipsoid') return `ellipsoid ${radii.map(round).join(' × ')} m`;
  if (kind === 'capsule' || kind === 'cylinder')
    return `${kind}, radius ${round(radius)} m, length ${round(length)} m`;
  if (kind === 'hull') return `convex hull of ${points.length / 3} points`;
  if (kind === 'mesh') return `mesh of ${indices.length / 3} triangles`;
  if (kind === 'heights') return `terrain of ${columns} × ${rows} samples`;
  return kind;
}
