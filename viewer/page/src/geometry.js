// Shapes of the world as geometries to draw: common ones as one unit shape with a size for each body.
import {
  BoxGeometry, BufferAttribute, BufferGeometry, CapsuleGeometry, CylinderGeometry, Matrix4, PlaneGeometry,
  Quaternion, SphereGeometry, Vector3,
} from 'three';
import {ConvexGeometry} from 'three/addons/geometries/ConvexGeometry.js';
import {mergeGeometries} from 'three/addons/utils/BufferGeometryUtils.js';

const kPlaneHalf = 5e4;     // m: as far as anyone sees
const kPlaneParts = 32;     // along each side, the smaller the nearer to the middle,
const kPlaneGrowth = 2000;  // the outermost by this compared to the innermost

const triples = (flat) =>
    Array.from({length: flat.length / 3}, (_, n) => new Vector3(...flat.slice(3 * n, 3 * n + 3)));

// Cylinders and capsules of the world lie along z, those of three.js along y.
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

// In parts, since the depth of one triangle of that size is too coarse for what lies on it.
function plane({normal}) {
  const geometry = new PlaneGeometry(2, 2, kPlaneParts, kPlaneParts);
  const {array} = geometry.attributes.position;
  const spread = (x) => Math.sign(x) * kPlaneHalf * (kPlaneGrowth ** Math.abs(x) - 1) / (kPlaneGrowth - 1);
  array.forEach((x, n) => array[n] = spread(x));
  return geometry.applyQuaternion(
      new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), new Vector3(...normal)));
}

const kUnits = {
  box: () => new BoxGeometry(1, 1, 1),
  sphere: () => new SphereGeometry(1, 28, 18),
  cylinder: () => alongZ(new CylinderGeometry(1, 1, 1, 32)),
};

const kMakers = {
  box: ({size}) => new BoxGeometry(...size),
  sphere: ({radius}) => new SphereGeometry(radius, 28, 18),
  ellipsoid: ({radii}) => new SphereGeometry(1, 28, 18).scale(...radii),
  cylinder: ({radius, length}) => alongZ(new CylinderGeometry(radius, radius, length, 32)),
  capsule: ({radius, length}) => alongZ(new CapsuleGeometry(radius, length, 8, 24)),
  plane,
  hull: ({points}) => new ConvexGeometry(triples(points)),
  mesh,
  heights: heightField,
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

function placed(part) {
  const geometry = kMakers[part.kind](part);
  const one = new Vector3(1, 1, 1);
  geometry.applyMatrix4(
      new Matrix4().compose(new Vector3(...part.position), new Quaternion(...part.orientation), one));
  const flat = geometry.index ? geometry.toNonIndexed() : geometry;
  flat.deleteAttribute('uv');
  return flat;
}

// {key, size, make, isBox, radius} of a shape; bodies with equal keys are drawn together, each with its size.
export function drawnAs(id, parts) {
  if (parts.length === 1 && isAtOrigin(parts[0])) {
    const [unit, size] = sizeOf(parts[0]);
    if (unit) return {key: unit, size, make: kUnits[unit], isBox: unit === 'box'};
  }
  return {key: `shape ${id}`, size: [1, 1, 1], make: () => mergeGeometries(parts.map(placed)), isBox: false};
}

// The radius (m) of a ball around the origin that holds a geometry of that size along each axis.
export function radiusOf(geometry, size) {
  if (geometry.boundingSphere === null) geometry.computeBoundingSphere();
  const {center, radius} = geometry.boundingSphere;
  return (center.length() + radius) * Math.max(...size);
}

const round = (x) => Number(x.toPrecision(4));

// In a few words, for people.
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
