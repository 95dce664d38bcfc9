// Shading of bodies: instanced, each interpolated between two poses from the server and with its own colour.
// Boxes have thin edge lines; static bodies have a grid aligned with the sectors; triggers are translucent.
import {MeshDepthMaterial, MeshLambertMaterial, RGBADepthPacking} from 'three';

export const uniforms = {
  uBlend: {value: 1},  // from the previous pose (0) to the latest (1)
  uSectorSize: {value: 128},
  uHeight: {value: 800},  // of the picture, in pixels
  uLooks: {value: 0},     // 1: bodies that have colours of their own show them
  uGroundDim: {value: 0.42},  // what colours of static bodies are multiplied by, between the lines
  uGroundLine: {value: [0.32, 0.42, 0.52]},
};

export const kShadowMapSize = 2048;  // pixels

const kPose = `
  attribute vec3 position0, position1, size;
  attribute vec4 rotation0, rotation1;
  uniform float uBlend;
  vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
  vec4 rotationNow() {
    vec4 to = dot(rotation0, rotation1) < 0.0 ? -rotation1 : rotation1;
    return normalize(mix(rotation0, to, uBlend));
  }
  vec3 placeNow() { return mix(position0, position1, uBlend); }
`;

// A point as large as a ball of radius size.x.
const kPointSize = (height) =>
    `gl_PointSize = max(size.x * projectionMatrix[1][1] * ${height} / gl_Position.w, 1.5);`;

// Where in the ball of a point a fragment is: towards the eye from its plane.
const kPointNormal = `
  vec3 normal = vec3(2.0 * gl_PointCoord.x - 1.0, 1.0 - 2.0 * gl_PointCoord.y, 0.0);
  normal.z = 1.0 - dot(normal, normal);
  if (normal.z < 0.0) discard;
  normal.z = sqrt(normal.z);
`;

const kVertexHead = `
  ${kPose}
  attribute vec4 tint;
  varying vec3 vTint, vLocal, vSize, vPlace, vFacing;
  varying float vGround;
`;

const kFragmentHead = `
  uniform float uSectorSize, uGroundDim;
  uniform vec3 uGroundLine;
  varying vec3 vTint, vLocal, vSize, vPlace, vFacing;
  varying float vGround;
  float lines(vec2 at, vec2 pixel, float spacing) {
    float wide = max(pixel.x, pixel.y) / spacing;
    if (wide > 0.5) return 0.0;
    vec2 away = abs(fract(at / spacing - 0.5) - 0.5) * spacing / max(pixel, vec2(1e-6));
    return (1.0 - min(min(away.x, away.y), 1.0)) * (1.0 - smoothstep(0.15, 0.5, wide));
  }
  float ground() {
    vec3 facing = abs(vFacing);
    vec2 at = facing.z >= max(facing.x, facing.y) ? vPlace.xy : facing.x > facing.y ? vPlace.yz : vPlace.xz;
    vec2 pixel = fwidth(at);
    float fine = lines(at, pixel, uSectorSize / 128.0) * 0.06;
    float middle = lines(at, pixel, uSectorSize / 16.0) * 0.14;
    float border = lines(at - uSectorSize / 2.0, pixel, uSectorSize) * 0.5;
    return max(max(fine, middle), border);
  }
`;

const kEdges = `
  vec3 toEdge = 0.5 * vSize - abs(vLocal);
  float low = min(toEdge.x, min(toEdge.y, toEdge.z));
  float high = max(toEdge.x, max(toEdge.y, toEdge.z));
  float nearest = toEdge.x + toEdge.y + toEdge.z - low - high;
  float pixel = max(fwidth(nearest), 1e-6);
  float edge = 1.0 - smoothstep(0.6, 2.0, nearest / pixel);
  float isNear = 1.0 - smoothstep(0.04, 0.2, pixel / min(vSize.x, min(vSize.y, vSize.z)));
  diffuseColor.rgb *= 1.0 - 0.45 * edge * isNear;
`;

// The tint of a body in its own colours is how far it is lit up.
const kOwnColours = 'if (uLooks > 0.5) diffuseColor.rgb = mix(vColour * vColour, vec3(1.0), vTint.r);';

function adapt(material, isBox, hasColours) {
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader =
        shader.vertexShader.replace('#include <common>', `#include <common>\n${kVertexHead}${
                hasColours ? 'attribute vec3 colour; varying vec3 vColour;' : ''}`)
            .replace('#include <beginnormal_vertex>', `
        vec4 rotation = rotationNow();
        vec3 objectNormal = turned(rotation, normalize(normal / size));`)
            .replace('#include <begin_vertex>', `
        vLocal = position * size;
        vec3 transformed = turned(rotation, vLocal) + placeNow();
        vTint = tint.rgb; vGround = tint.a; vSize = size; vPlace = transformed; vFacing = objectNormal;
        ${hasColours ? 'vColour = colour;' : ''}`);
    shader.fragmentShader =
        shader.fragmentShader.replace('#include <common>', `#include <common>\n${kFragmentHead}${
                hasColours ? 'uniform float uLooks; varying vec3 vColour;' : ''}`)
            .replace('#include <color_fragment>', `
        diffuseColor.rgb = vTint * vTint;
        ${hasColours ? kOwnColours : ''}
        ${isBox ? kEdges : ''}
        vec3 plain = diffuseColor.rgb * uGroundDim;
        if (vGround > 0.5) diffuseColor.rgb = mix(plain, uGroundLine, ground());`);
  };
  material.customProgramCacheKey = () => `body ${isBox} ${hasColours}`;
  return material;
}

const kTrigger = {transparent: true, opacity: 0.25, depthWrite: false};

export const bodyMaterial = (isBox, hasColours, isTrigger) =>
    adapt(new MeshLambertMaterial(isTrigger ? kTrigger : {}), isBox, hasColours);

export function pointMaterial() {
  const material = new MeshLambertMaterial();
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader =
        shader.vertexShader
            .replace('#include <common>', `#include <common>\n${kPose}
              uniform float uHeight;
              attribute vec4 tint;
              varying vec3 vTint;`)
            .replace('#include <beginnormal_vertex>', 'vec3 objectNormal = vec3(0.0, 0.0, 1.0);')
            .replace('#include <begin_vertex>', 'vec3 transformed = placeNow(); vTint = tint.rgb;')
            .replace('#include <project_vertex>', `#include <project_vertex>\n${kPointSize('uHeight')}`);
    shader.fragmentShader =
        shader.fragmentShader.replace('#include <common>', '#include <common>\nvarying vec3 vTint;')
            .replace('#include <color_fragment>', 'diffuseColor.rgb = vTint * vTint;')
            .replace('#include <normal_fragment_begin>', kPointNormal)
            .replace('#include <normal_fragment_maps>', '');
  };
  material.customProgramCacheKey = () => 'body point';
  return material;
}

function shadow(name, place, size, shape) {
  const material = new MeshDepthMaterial({depthPacking: RGBADepthPacking});
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = shader.vertexShader.replace('#include <common>', `#include <common>\n${kPose}`)
                              .replace('#include <begin_vertex>', `vec3 transformed = ${place};`)
                              .replace('#include <project_vertex>', `#include <project_vertex>\n${size}`);
    shader.fragmentShader = shader.fragmentShader.replace('#include <map_fragment>', shape);
  };
  material.customProgramCacheKey = () => `shadow of ${name}`;
  return material;
}

export const shadowMaterial = () =>
    shadow('body', 'turned(rotationNow(), position * size) + placeNow()', '', '');

export const pointShadowMaterial = () =>
    shadow('point', 'placeNow()', kPointSize(kShadowMapSize.toFixed(1)), kPointNormal);
