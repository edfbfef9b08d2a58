/** The cloud is drawn into a picture with depths; this lays it on the page, with its edges shaded (eye-dome lighting). */
import * as THREE from 'three';

const FRAGMENT = /* glsl */ `
precision highp float;
in vec2 vAt;
uniform sampler2D uColour;
uniform sampler2D uDepth;
uniform vec2 uPixel;
uniform float uStrength;
uniform float uRadius;
uniform vec2 uNearFar;
uniform bool uOrtho;
uniform vec3 uBackground;
layout(location = 0) out vec4 colour;

float away(float depth) {
  if (uOrtho) return mix(uNearFar.x, uNearFar.y, depth);
  return uNearFar.x * uNearFar.y / (uNearFar.y - depth * (uNearFar.y - uNearFar.x));
}

void main() {
  float depth = texture(uDepth, vAt).r;
  vec3 base = texture(uColour, vAt).rgb;
  float shade = 1.0;
  if (uStrength > 0.0) {
    // how much nearer the neighbours are, by their ratio where the view is perspective
    float here = away(depth);
    float sum = 0.0;
    for (int k = 0; k < 8; k++) {
      float angle = 0.78539816 * float(k);
      float there = away(texture(uDepth, vAt + uPixel * uRadius * vec2(cos(angle), sin(angle))).r);
      sum += uOrtho ? max(0.0, here - there) * 12.0 / (uNearFar.y - uNearFar.x) : max(0.0, log2(here) - log2(there));
    }
    shade = exp(-sum / 8.0 * uStrength * 60.0);
  }
  if (depth >= 1.0) {
    colour = vec4(uBackground, 1.0);
  } else {
    colour = vec4(base * max(shade, 0.12), 1.0);
  }
  gl_FragDepth = depth;
}`;

export class Composite {
  constructor() {
    this.target = new THREE.WebGLRenderTarget(1, 1, { type: THREE.UnsignedByteType, depthBuffer: true });
    this.target.depthTexture = new THREE.DepthTexture(1, 1, THREE.FloatType);
    this.uniforms = {
      uColour: { value: this.target.texture },
      uDepth: { value: this.target.depthTexture },
      uPixel: { value: new THREE.Vector2() },
      uStrength: { value: 0.5 },
      uRadius: { value: 1.4 },
      uNearFar: { value: new THREE.Vector2(0.1, 1000) },
      uOrtho: { value: false },
      uBackground: { value: new THREE.Vector3(1, 1, 1) },
    };
    const triangle = new THREE.BufferGeometry();
    triangle.setAttribute('position', new THREE.BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    const material = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3,
      vertexShader: 'out vec2 vAt; void main() { vAt = position.xy * 0.5 + 0.5; gl_Position = vec4(position.xy, 0.0, 1.0); }',
      fragmentShader: FRAGMENT,
      uniforms: this.uniforms,
      depthFunc: THREE.AlwaysDepth,
    });
    const mesh = new THREE.Mesh(triangle, material);
    mesh.frustumCulled = false;
    this.scene = new THREE.Scene();
    this.scene.add(mesh);
    this.camera = new THREE.Camera();
  }

  size(width, height) {
    this.target.setSize(width, height);
    this.uniforms.uPixel.value.set(1 / width, 1 / height);
  }

  /** @param {THREE.WebGLRenderer} renderer @param {THREE.Scene} cloud @param {any} camera */
  draw(renderer, cloud, camera) {
    renderer.setRenderTarget(this.target);
    renderer.setClearColor(0x000000, 0);
    renderer.clear();
    renderer.render(cloud, camera);
    renderer.setRenderTarget(null);
    this.uniforms.uNearFar.value.set(camera.near, camera.far);
    this.uniforms.uOrtho.value = Boolean(camera.isOrthographicCamera);
    renderer.clear();
    renderer.render(this.scene, this.camera);
  }
}
