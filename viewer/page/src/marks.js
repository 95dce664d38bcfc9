// What is drawn beside the bodies: borders of sectors, contacts, the ray that was cast, the planet.
import {
  AdditiveBlending, BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Group, LineBasicMaterial,
  LineSegments, Mesh, MeshBasicMaterial, Points, PointsMaterial, SphereGeometry, WireframeGeometry,
} from 'three';

import {serverColour} from './colours.js';

const kSectorsMax = 600;
const kNormalLength = 0.35;  // m
const kRaySeconds = 4;
const kPlanetFrom = 2000;  // m from its surface: nearer, the bodies that lie there are its ground

const kCorners = [0, 1, 2, 3, 4, 5, 6, 7].map((n) => [(n & 1) - 0.5, (n >> 1 & 1) - 0.5, (n >> 2) - 0.5]);
const kEdges = [];
for (let a = 0; a < 8; ++a) {
  for (const bit of [1, 2, 4]) {
    if (!(a & bit)) kEdges.push([a, a | bit]);
  }
}

function lines(options) {
  const object =
      new LineSegments(new BufferGeometry(), new LineBasicMaterial({transparent: true, ...options}));
  object.frustumCulled = false;
  object.visible = false;
  return object;
}

function set(object, positions, colours) {
  object.geometry.dispose();
  object.geometry = new BufferGeometry();
  object.geometry.setAttribute('position', new BufferAttribute(positions, 3).setUsage(DynamicDrawUsage));
  if (colours) object.geometry.setAttribute('color', new BufferAttribute(colours, 3));
}

// A cube for each sector that has bodies, in the colour of its server, and one for the sector of the focus.
export class SectorGrid {
  constructor() { this.object = lines({vertexColors: true, opacity: 0.55, depthWrite: false}); }

  show(sectors, focusOffset, size) {
    const cubes =
        sectors.slice(0, kSectorsMax).map(({offset,
                                            server}) => ({offset, colour: new Color(serverColour(server))}));
    cubes.push({offset: focusOffset, colour: new Color('#ffffff')});
    const positions = new Float32Array(cubes.length * kEdges.length * 6);
    const colours = new Float32Array(positions.length);
    let at = 0;
    for (const {offset, colour} of cubes) {
      for (const edge of kEdges) {
        for (const corner of edge) {
          for (let axis = 0; axis < 3; ++axis)
            positions[at + axis] = (offset[axis] + kCorners[corner][axis]) * size;
          colour.toArray(colours, at);
          at += 3;
        }
      }
    }
    set(this.object, positions, colours);
  }
}

// A point where two bodies touch, brighter the harder, with the normal.
export class Contacts {
  constructor() {
    this.points = new Points(new BufferGeometry(), new PointsMaterial({
                               size: 5,
                               sizeAttenuation: false,
                               vertexColors: true,
                               transparent: true,
                               depthTest: false,
                               opacity: 0.9
                             }));
    this.points.frustumCulled = false;
    this.normals = lines({color: '#ffd479', opacity: 0.6, depthTest: false});
    this.object = new Group();
    this.object.add(this.points, this.normals);
    this.object.visible = false;
    this.normals.visible = true;
    this.count = 0;
  }

  show({count, positions, normals, impulses}) {
    const colours = new Float32Array(3 * count);
    const ends = new Float32Array(6 * count);
    const weak = new Color('#c98f3d');
    const strong = new Color('#fff3cf');
    for (let n = 0; n < count; ++n) {
      const share = Math.min(1, Math.log10(1 + 10 * impulses[n]) / 3);
      weak.clone().lerp(strong, share).toArray(colours, 3 * n);
      for (let axis = 0; axis < 3; ++axis) {
        ends[6 * n + axis] = positions[3 * n + axis];
        ends[6 * n + 3 + axis] = positions[3 * n + axis] + kNormalLength * normals[3 * n + axis];
      }
    }
    this.count = count;
    set(this.points, positions.slice(), colours);
    set(this.normals, ends);
  }
}

// The last ray that was cast, for some seconds.
export class Ray {
  constructor() {
    this.object = lines({color: '#ff8fb1', blending: AdditiveBlending, depthTest: false});
    this.until = 0;
  }

  // Metres from the centre of the view's sector.
  show(from, to) {
    set(this.object, new Float32Array([...from, ...to]));
    this.object.visible = true;
    this.until = performance.now() + 1000 * kRaySeconds;
  }

  advance(now) {
    const left = (this.until - now) / (1000 * kRaySeconds);
    this.object.visible = left > 0;
    this.object.material.opacity = Math.max(left, 0);
  }
}

// The globe, from far away.
export class Planet {
  constructor() {
    const sphere = new SphereGeometry(1, 96, 64).rotateX(Math.PI / 2);
    const meridians = new SphereGeometry(1.0005, 36, 18).rotateX(Math.PI / 2);
    this.object = new Group();
    this.ball = new Mesh(sphere, new MeshBasicMaterial({color: '#141c26', transparent: true}));
    this.net = new LineSegments(
        new WireframeGeometry(meridians),
        new LineBasicMaterial({color: '#3b5166', transparent: true, opacity: 0.35}));
    this.object.add(this.ball, this.net);
    this.object.visible = false;
  }

  // Distances of the eye in m.
  show(planet, eye) {
    if (!planet) {
      this.object.visible = false;
      return;
    }
    const height = Math.hypot(...planet.centre.map((x, axis) => x - eye[axis])) - planet.radius;
    const share = Math.min(Math.max((height - kPlanetFrom) / (4 * kPlanetFrom), 0), 1);
    this.object.visible = share > 0;
    this.ball.material.opacity = share;
    this.net.material.opacity = 0.35 * share;
    this.object.position.set(...planet.centre);
    this.object.scale.setScalar(planet.radius);
  }
}
