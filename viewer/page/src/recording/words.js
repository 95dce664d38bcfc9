// Converts messages of a recording to the JSON of tessera-viewer (viewer/json.cc).

const kMotions = ['dynamic', 'static', 'kinematic'];

export const vectorOf = (vector) => [vector?.x ?? 0, vector?.y ?? 0, vector?.z ?? 0];
const quaternionOf = (q) => q ? [q.x, q.y, q.z, q.w] : [0, 0, 0, 1];
export const sectorOf = (index) => [index?.i ?? 0n, index?.j ?? 0n, index?.k ?? 0n];
export const positionOf = (place) => ({sector: sectorOf(place?.sector), local: vectorOf(place?.local)});

const kGeometries = {
  box: ({size}) => ({kind: 'box', size: vectorOf(size)}),
  sphere: ({radius}) => ({kind: 'sphere', radius}),
  capsule: ({radius, length}) => ({kind: 'capsule', radius, length}),
  cylinder: ({radius, length}) => ({kind: 'cylinder', radius, length}),
  ellipsoid: ({radii}) => ({kind: 'ellipsoid', radii: vectorOf(radii)}),
  plane: ({normal}) => ({kind: 'plane', normal: vectorOf(normal)}),
  convexHull: ({points}) => ({kind: 'hull', points}),
  triangleMesh: ({vertices, indices}) => ({kind: 'mesh', vertices, indices}),
  heightField: ({columns, rows, spacingX, spacingY, heights}) =>
      ({kind: 'heights', columns, rows, spacing: [spacingX, spacingY], heights}),
  ground: () => ({kind: 'ground'}),
};

// The parts of a tessera.v1.Shape.
export const partsOf = ({parts}) => parts.map(({geometry: {kind}, pose, material}) => ({
                                                ...kGeometries[kind.case](kind.value),
                                                position: vectorOf(pose?.position),
                                                orientation: quaternionOf(pose?.orientation),
                                                ...(material?.trigger && {trigger: true}),
                                              }));

// A body of a tessera.v1.FoundBodies.
export const bodyOf = ({id, name, properties}) => ({
  id: Number(id),
  name,
  shape: Number(properties.shape),
  motion: kMotions[properties.motion],
  trigger: properties.trigger,
  mass: properties.mass,
  centre: vectorOf(properties.centre),
  friction: properties.friction,
  restitution: properties.restitution,
});
