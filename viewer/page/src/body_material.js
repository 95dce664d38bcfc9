// How bodies are shaded: many at once, each between two poses that the server told, with a colour of its own;
// boxes with fine edges, and what never moves with a grid that is part of the sectors.
import {MeshDepthMaterial, MeshLambertMaterial, RGBADepthPacking} from 'three';

// Shared by all bodies.
export const uniforms = {
  uBlend: {value: 1},  // from the pose before (0) to the last one (1)
  uSectorSize: {value: 128},
};

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

const kVertexHead = `
  ${kPose}
  attribute vec4 tint;
  varying vec3 vTint, vLocal, vSize, vPlace, vFacing;
  varying float vGround;
`;

const kFragmentHead = `
  uniform float uSectorSize;
  varying vec3 vTint, vLocal, vSize, vPlace, vFacing;
  varying float vGround;
  float lines(vec2 at, float spacing) {
    vec2 cells = at / spacing;
    vec2 width = fwidth(cells);
    vec2 away = abs(fract(cells - 0.5) - 0.5) / max(width, vec2(1e-6));
    float visible = 1.0 - smoothstep(0.15, 0.5, max(width.x, width.y));
    return (1.0 - min(min(away.x, away.y), 1.0)) * visible;
  }
  float ground() {
    vec3 facing = abs(vFacing);
    vec2 at = facing.z >= max(facing.x, facing.y) ? vPlace.xy : facing.x > facing.y ? vPlace.yz : vPlace.xz;
    float fine = lines(at, uSectorSize / 128.0) * 0.06;
    float middle = lines(at, uSectorSize / 16.0) * 0.14;
    float border = lines(at - uSectorSize / 2.0, uSectorSize) * 0.5;
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

function adapt(material, isBox) {
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader =
        shader.vertexShader.replace('#include <common>', `#include <common>\n${kVertexHead}`)
            .replace('#include <beginnormal_vertex>', `
        vec4 rotation = rotationNow();
        vec3 objectNormal = turned(rotation, normalize(normal / size));`)
            .replace('#include <begin_vertex>', `
        vLocal = position * size;
        vec3 transformed = turned(rotation, vLocal) + placeNow();
        vTint = tint.rgb; vGround = tint.a; vSize = size; vPlace = transformed; vFacing = objectNormal;`);
    shader.fragmentShader =
        shader.fragmentShader.replace('#include <common>', `#include <common>\n${kFragmentHead}`)
            .replace('#include <color_fragment>', `
        diffuseColor.rgb = vTint * vTint;
        ${isBox ? kEdges : ''}
        vec3 dark = diffuseColor.rgb * 0.42;
        if (vGround > 0.5) diffuseColor.rgb = mix(dark, vec3(0.32, 0.42, 0.52), ground());`);
  };
  material.customProgramCacheKey = () => `body ${isBox}`;
  return material;
}

export const bodyMaterial = (isBox) => adapt(new MeshLambertMaterial(), isBox);

export function shadowMaterial() {
  const material = new MeshDepthMaterial({depthPacking: RGBADepthPacking});
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = shader.vertexShader.replace('#include <common>', `#include <common>\n${kPose}`)
                              .replace(
                                  '#include <begin_vertex>',
                                  'vec3 transformed = turned(rotationNow(), position * size) + placeNow();');
  };
  material.customProgramCacheKey = () => 'body shadow';
  return material;
}
