// The picture: light, shadows, fog, and everything drawn in it.
import {
  Color, DirectionalLight, Fog, HemisphereLight, PCFSoftShadowMap, Raycaster, Scene, Vector2, Vector3,
  WebGLRenderer,
} from 'three';

import {kShadowMapSize, uniforms} from './body_material.js';
import {Contacts, Planet, Ray, Seams, SectorGrid, SensorRays} from './marks.js';

const kSlowFrameMs = 36;
const kSlowForMs = 1200;  // of slow frames before the next economy applies
const kEconomies = [
  (picture) => {
    picture.shadows = false;
    picture.onTooSlow();
  },
  ({bodies}) => bodies.pointPixels = 9,
  (picture) => picture.ratioMax = 0.75,
  ({bodies}) => bodies.pointPixels = 16,
  (picture) => picture.ratioMax = 0.5,
];

// Whether rendering is done by the CPU, as far as the browser tells.
function drawsInSoftware() {
  const gl = document.createElement('canvas').getContext('webgl2');
  const told = gl?.getExtension('WEBGL_debug_renderer_info');
  const name = told ? gl.getParameter(told.UNMASKED_RENDERER_WEBGL) : '';
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

export class Picture {
  // `detail` is "fine" (smooth edges and shadows, however slow) or "fast"; null: chosen by the renderer.
  constructor(canvas, bodies, detail) {
    this.canvas = canvas;
    this.bodies = bodies;
    const isFine = detail ? detail === 'fine' : !drawsInSoftware();
    this.renderer = new WebGLRenderer({canvas, antialias: isFine, powerPreference: 'high-performance'});
    this.renderer.shadowMap.type = PCFSoftShadowMap;
    this.scene = new Scene();
    this.scene.background = new Color();
    this.scene.fog = new Fog(0, 100, 1000);
    this.sky = new HemisphereLight('#dfe9f5', '#4a515c', 1.9);
    this.sun = new DirectionalLight('#fff4e2', 2.6);
    this.sun.shadow.mapSize.set(kShadowMapSize, kShadowMapSize);
    this.sun.shadow.bias = -0.0004;
    this.sun.shadow.normalBias = 0.02;
    this.grid = new SectorGrid();
    this.contacts = new Contacts();
    this.seams = new Seams();
    this.ray = new Ray();
    this.sensorRays = new SensorRays();
    this.planet = new Planet();
    this.scene.add(
        bodies.group, this.sky, this.sun, this.sun.target, this.grid.object, this.contacts.object,
        this.seams.object, this.ray.object, this.sensorRays.object,
        this.planet.object);
    this.shadows = isFine;
    this.#economies = isFine ? 0 : 1;
    this.mayCoarsen = detail !== 'fine';  // if drawing is too slow
    this.onTooSlow = () => {};
    this.ratioMax = 2;
  }
  #slowMs = 0;
  #economies;  // number applied so far

  set shadows(on) {
    this.renderer.shadowMap.enabled = on;
    this.sun.castShadow = on;
    this.#slowMs = 0;
  }
  get shadows() { return this.sun.castShadow; }

  // The colours of a theme, `picture`.
  use(colours) {
    this.scene.background.set(colours.sky);
    this.scene.fog.color.set(colours.sky);
    uniforms.uGroundDim.value = colours.groundDim;
    uniforms.uGroundLine.value = colours.groundLine;
    for (const mark of [this.grid, this.contacts, this.sensorRays, this.planet]) mark.use(colours);
  }

  // Draws one frame; `frameMs` is the duration of the last.
  draw(camera, view, half, frameMs) {
    const {clientWidth: width, clientHeight: height} = this.canvas;
    const ratio = Math.min(devicePixelRatio, this.ratioMax);
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);  // reallocates the canvas
    const size = this.renderer.getSize(new Vector2());
    if (size.x !== width || size.y !== height) this.renderer.setSize(width, height, false);
    const isFar = view.planet && camera.distance > 2000;
    const reach =
        Math.max(4 * half, 6 * camera.distance, isFar ? 4 * (view.planet.radius + camera.distance) : 0);
    const target = this.aim(camera, view, reach);
    this.scene.fog.near = isFar ? reach : Math.max(half * 0.5, camera.distance * 1.5);
    this.scene.fog.far = isFar ? 2 * reach : Math.max(half * 2.2, camera.distance * 6);
    this.#light(camera, target);
    this.planet.show(view.planet, camera.three.position.toArray());
    this.ray.advance(performance.now());
    this.bodies.prepare(camera.three, height * ratio);
    this.renderer.render(this.scene, camera.three);
    this.#watchSpeed(frameMs);
  }

  // Where the camera looks, in metres from the centre of the view's sector.
  aim(camera, view, reach = camera.three.far) {
    return camera.place(view.sector, this.canvas.clientWidth / this.canvas.clientHeight, reach);
  }

  #light(camera, target) {
    const {right, forward} = camera.directions();
    const fixed = new Vector3(0.45, 0.3, 0.84);
    const up = camera.up;
    // The light is fixed to the world where it shines from above, and to the camera on the far side of a planet.
    const direction =
        fixed.dot(up) > 0.3 ? fixed : up.clone().addScaledVector(right, 0.5).addScaledVector(forward, -0.3);
    const width = Math.min(Math.max(camera.distance * 1.3, 6), 400);
    this.sun.target.position.copy(target);
    this.sun.position.copy(target).addScaledVector(direction.normalize(), 3 * width);
    this.sky.position.copy(up);
    const shadow = this.sun.shadow.camera;
    shadow.left = shadow.bottom = -width;
    shadow.right = shadow.top = width;
    shadow.near = width * 0.5;
    shadow.far = width * 6;
    shadow.updateProjectionMatrix();
  }

  #watchSpeed(frameMs) {
    this.#slowMs = frameMs > kSlowFrameMs ? this.#slowMs + frameMs : Math.max(0, this.#slowMs - frameMs);
    if (this.#slowMs < kSlowForMs || !this.mayCoarsen || this.#economies === kEconomies.length) return;
    this.#slowMs = 0;
    kEconomies[this.#economies++](this);
  }

  // The ray from the eye through a point of the window, in metres from the centre of the view's sector.
  rayThrough(camera, view, {clientX, clientY}) {
    this.aim(camera, view);
    const box = this.canvas.getBoundingClientRect();
    const point =
        new Vector2((clientX - box.left) / box.width * 2 - 1, 1 - (clientY - box.top) / box.height * 2);
    const caster = new Raycaster();
    caster.setFromCamera(point, camera.three);
    return {origin: caster.ray.origin.toArray(), direction: caster.ray.direction.toArray()};
  }

  // Projects a point of the world into the window, in pixels; null if it is outside or behind the camera.
  toWindow(camera, local) {
    const point = new Vector3(...local).project(camera.three);
    if (point.z > 1 || Math.abs(point.x) > 1.1 || Math.abs(point.y) > 1.1) return null;
    const {clientWidth: width, clientHeight: height} = this.canvas;
    return [(point.x + 1) / 2 * width, (1 - point.y) / 2 * height];
  }
}
