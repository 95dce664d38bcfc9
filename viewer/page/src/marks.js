// What is drawn in addition to bodies: sector borders, contacts, seams, the ray, the planet.
import {
  Box3, BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Group, LineBasicMaterial,
  LineSegments, Mesh, MeshBasicMaterial, Points, PointsMaterial, SphereGeometry, Vector3,
} from 'three';

import {serverColour} from './colours.js';

const kSectorsMax = 600;
const kNormalLength = 0.35;  // m
const kRaySeconds = 4;
const kShellsMax = 500;
const kShellScale = 1.08;  // so that a clone is visible around its body
const kGoldenShare = 0.618034;  // of the circle of hues, from one island to the next
const kPlanetFrom = 2000;  // m above its surface: any closer, static bodies form the ground

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

const shellMaterials = new Map();
function shellMaterial(colour) {
  if (!shellMaterials.has(colour)) {
    shellMaterials.set(
        colour, new MeshBasicMaterial({color: colour, transparent: true, opacity: 0.3, depthWrite: false}));
  }
  return shellMaterials.get(colour);
}

// A cube for each sector with bodies, in the colour of its server, and one for the sector of the focus.
export class SectorGrid {
  #focus = new Color();

  constructor() { this.object = lines({vertexColors: true, opacity: 0.55, depthWrite: false}); }

  use({focus}) { this.#focus.set(focus); }

  show(sectors, focusOffset, size) {
    const cubes =
        sectors.slice(0, kSectorsMax).map(({offset,
                                            server}) => ({offset, colour: new Color(serverColour(server))}));
    cubes.push({offset: focusOffset, colour: this.#focus});
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

// Contact points, brighter for larger impulses, with their normals.
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
    this.normals = lines({opacity: 0.6, depthTest: false});
    this.object = new Group();
    this.object.add(this.points, this.normals);
    this.object.visible = false;
    this.normals.visible = true;
    this.count = 0;
  }
  #weak = new Color();
  #strong = new Color();

  // From the next contacts on.
  use({contact: [weak, strong]}) {
    this.#weak.set(weak);
    this.#strong.set(strong);
    this.normals.material.color.set(weak).lerp(this.#strong, 0.4);
  }

  show({count, positions, normals, impulses}) {
    const colours = new Float32Array(3 * count);
    const ends = new Float32Array(6 * count);
    for (let n = 0; n < count; ++n) {
      const share = Math.min(1, Math.log10(1 + 10 * impulses[n]) / 3);
      this.#weak.clone().lerp(this.#strong, share).toArray(colours, 3 * n);
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

// Seams: clones as shells in the colours of their servers, and a box around each island that crosses a border,
// in its own colour.
export class Seams {
  #shells = [];   // {mesh, id}
  #islands = [];  // {colour, bodies}

  constructor() {
    this.shells = new Group();
    this.boxes = lines({vertexColors: true, opacity: 0.9});
    this.boxes.visible = true;
    this.object = new Group();
    this.object.add(this.shells, this.boxes);
    this.object.visible = false;
  }

  get countClones() { return this.#shells.length; }
  get countIslands() { return this.#islands.length; }

  show({clones, islands}, bodies) {
    this.shells.clear();
    this.#shells = [];
    for (const {body, server} of clones.slice(0, kShellsMax)) {
      const form = bodies.formOf(body);
      if (!form) continue;
      const mesh = new Mesh(form.geometry, shellMaterial(serverColour(server)));
      mesh.scale.set(...form.size).multiplyScalar(kShellScale);
      this.shells.add(mesh);
      this.#shells.push({mesh, id: body});
    }
    this.#islands = islands.map((island) => ({
                                  colour: new Color().setHSL(island.id * kGoldenShare % 1, 0.75, 0.65),
                                  bodies: island.bodies
                                }));
    this.advance(bodies);
  }

  // Moves shells and boxes to their bodies.
  advance(bodies) {
    for (const {mesh, id} of this.#shells) {
      const body = bodies.look(id);
      mesh.visible = body !== null;
      if (!body) continue;
      mesh.position.set(...body.position.local);
      mesh.quaternion.set(...body.orientation);
    }
    const positions = [];
    const colours = [];
    for (const {colour, bodies: members} of this.#islands) {
      const box = new Box3();
      for (const id of members) {
        const body = bodies.look(id);
        if (!body) continue;
        const reach = bodies.formOf(id).radius;
        const centre = new Vector3(...body.position.local);
        box.expandByPoint(centre.clone().subScalar(reach)).expandByPoint(centre.addScalar(reach));
      }
      if (box.isEmpty()) continue;
      const size = box.getSize(new Vector3()).toArray();
      const centre = box.getCenter(new Vector3()).toArray();
      for (const corner of kEdges.flat()) {
        positions.push(...kCorners[corner].map((share, axis) => centre[axis] + share * size[axis]));
        colours.push(...colour.toArray());
      }
    }
    set(this.boxes, new Float32Array(positions), new Float32Array(colours));
  }
}

// The last ray cast, shown for kRaySeconds.
export class Ray {
  constructor() {
    this.object = lines({color: '#ff5c8a', depthTest: false});
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

// What the rays of a sensor have met, in the frame of its body.
export class SensorRays {
  constructor() { this.object = lines({opacity: 0.35, depthWrite: false}); }

  use({sensorRay}) { this.object.material.color.set(sensorRay); }

  // Six numbers each, from where to where.
  show(rays) {
    this.object.visible = rays.length > 0;
    if (rays.length > 0) set(this.object, new Float32Array(rays));
  }

  // With a body of bodies.look().
  follow({position, orientation}) {
    this.object.position.set(...position.local);
    this.object.quaternion.set(...orientation);
  }
}

// Meridians and parallels of a ball of radius 1, ten degrees apart, as short lines slightly above it.
function globeNet() {
  const [degree, above] = [Math.PI / 180, 1.0005];
  const points = [];
  const put = (longitude, latitude) => points.push(
      above * Math.cos(latitude * degree) * Math.cos(longitude * degree),
      above * Math.cos(latitude * degree) * Math.sin(longitude * degree), above * Math.sin(latitude * degree));
  for (let longitude = 0; longitude < 360; longitude += 2) {
    for (let latitude = -90; latitude < 90; latitude += 2) {
      if (longitude % 10 === 0) {
        put(longitude, latitude);
        put(longitude, latitude + 2);
      }
      if (latitude % 10 === 0) {
        put(longitude, latitude);
        put(longitude + 2, latitude);
      }
    }
  }
  return new BufferGeometry().setAttribute('position', new BufferAttribute(new Float32Array(points), 3));
}

// The globe, from far away.
export class Planet {
  constructor() {
    const sphere = new SphereGeometry(1, 96, 64).rotateX(Math.PI / 2);
    this.object = new Group();
    this.ball = new Mesh(sphere, new MeshBasicMaterial({transparent: true}));
    this.net = new LineSegments(
        globeNet(), new LineBasicMaterial({transparent: true, opacity: 0.5}));
    this.object.add(this.ball, this.net);
    this.object.visible = false;
  }

  use({planet, net}) {
    this.ball.material.color.set(planet);
    this.net.material.color.set(net);
  }

  // `eye` in metres from the centre of the view's sector.
  show(planet, eye) {
    if (!planet) {
      this.object.visible = false;
      return;
    }
    const height = Math.hypot(...planet.centre.map((x, axis) => x - eye[axis])) - planet.radius;
    const share = Math.min(Math.max((height - kPlanetFrom) / (4 * kPlanetFrom), 0), 1);
    this.object.visible = share > 0;
    this.ball.material.opacity = share;
    this.net.material.opacity = 0.5 * share;
    this.object.position.set(...planet.centre);
    this.object.scale.setScalar(planet.radius);
  }
}
