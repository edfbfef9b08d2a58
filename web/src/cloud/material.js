/** How points are drawn: all attributes lie in memory beside the positions, so another colour costs one frame. */
import * as THREE from 'three';

export const MODES = ['station', 'rgb', 'intensity', 'sigma_x', 'sigma_y', 'sigma_z', 'sigma', 'incidence', 'distance', 'significance'];

const VERTEX = /* glsl */ `
in vec3 sigma;
in float intensity;
in float incidence;
in float distanceTo;
in float level;
in vec3 rgb;
uniform int uMode;
uniform vec2 uRange;
uniform vec3 uStation;
uniform bool uLacks;        // this cloud does not have what is shown
uniform vec3 uPlain;
uniform sampler2D uTable;
uniform float uSize;
uniform float uPixels;      // pixels of one metre, at one metre where the view is perspective
uniform float uSpacing;
uniform bool uFill;
uniform bool uOrtho;
uniform bool uSlice;
uniform vec3 uSliceCentre;
uniform vec3 uSliceHalf;
uniform vec2 uSliceTurn;
out vec3 vColour;

void main() {
  vec4 place = modelMatrix * vec4(position, 1.0);
  vec4 seen = viewMatrix * place;
  gl_Position = projectionMatrix * seen;
  if (uSlice) {
    vec3 d = place.xyz - uSliceCentre;
    d = vec3(uSliceTurn.x * d.x + uSliceTurn.y * d.y, uSliceTurn.x * d.y - uSliceTurn.y * d.x, d.z);
    if (any(greaterThan(abs(d), uSliceHalf))) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  }
  float pixels = uOrtho ? uPixels : uPixels / max(0.01, -seen.z);
  gl_PointSize = uFill ? clamp(uSize * uSpacing * pixels * 0.8, uSize, 3.0 * uSize) : uSize;
  if (uMode == 0) vColour = uStation;
  else if (uLacks) vColour = uPlain;
  else if (uMode == 1) vColour = rgb;
  else {
    float value = uMode == 2 ? intensity
      : uMode == 3 ? sigma.x
      : uMode == 4 ? sigma.y
      : uMode == 5 ? sigma.z
      : uMode == 6 ? length(sigma)
      : uMode == 7 ? incidence * 0.01
      : uMode == 8 ? distanceTo
      : distanceTo / max(level, 1e-9);
    float t = clamp((value - uRange.x) / (uRange.y - uRange.x), 0.0, 1.0);
    vColour = texture(uTable, vec2((t * 255.0 + 0.5) / 256.0, 0.5)).rgb;
  }
}`;

const FRAGMENT = /* glsl */ `
precision highp float;
in vec3 vColour;
uniform bool uRound;
layout(location = 0) out vec4 colour;
void main() {
  if (uRound) {
    vec2 d = gl_PointCoord - 0.5;
    if (dot(d, d) > 0.25) discard;
  }
  colour = vec4(vColour, 1.0);
}`;

/** What all clouds share; a change of one value is seen by every material. */
export function shared() {
  return {
    uMode: { value: 0 },
    uPlain: { value: new THREE.Vector3(0.62, 0.65, 0.69) },
    uRange: { value: new THREE.Vector2(0, 1) },
    uTable: { value: null },
    uSize: { value: 2 },
    uPixels: { value: 1000 },
    uFill: { value: true },
    uRound: { value: false },
    uOrtho: { value: false },
    uSlice: { value: false },
    uSliceCentre: { value: new THREE.Vector3() },
    uSliceHalf: { value: new THREE.Vector3(1, 1, 1) },
    uSliceTurn: { value: new THREE.Vector2(1, 0) },
  };
}

/** @param {ReturnType<typeof shared>} uniforms @param {number[]} station colour, 0 to 255 */
export function material(uniforms, station) {
  return new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3,
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    uniforms: {
      ...uniforms,
      uSpacing: { value: 1 },
      uLacks: { value: false },
      uStation: { value: new THREE.Vector3(...station.map((x) => x / 255)) },
    },
  });
}

/** @param {any} columns of one node @returns {THREE.BufferGeometry} */
export function geometry(columns) {
  const out = new THREE.BufferGeometry();
  out.setAttribute('position', new THREE.BufferAttribute(columns.position, 3));
  out.setAttribute('intensity', new THREE.BufferAttribute(columns.intensity, 1));
  if (columns.sigma) out.setAttribute('sigma', new THREE.BufferAttribute(columns.sigma, 3));
  if (columns.incidence) out.setAttribute('incidence', new THREE.BufferAttribute(columns.incidence, 1));
  if (columns.distance) out.setAttribute('distanceTo', new THREE.BufferAttribute(columns.distance, 1));
  if (columns.level) out.setAttribute('level', new THREE.BufferAttribute(columns.level, 1));
  if (columns.rgb) out.setAttribute('rgb', new THREE.BufferAttribute(columns.rgb, 3, true));
  return out;
}
