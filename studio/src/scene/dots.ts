/**
 * Bodies of a few pixels as points: a crowd seen from far away. A point needs a quarter of the corners of a quad, and a
 * software renderer takes half the time for it.
 */

import { BufferAttribute, BufferGeometry, DynamicDrawUsage, NoBlending, NormalBlending, Points } from "three";
import type { RawShaderMaterial } from "three";
import { material } from "./material";

const VERTEX = `
in vec3 dot;       // x, y, half side
in vec4 tint;
uniform float pxPerM;
uniform float minPx;
uniform float ratio;
flat out vec4 ink;
void main() {
  ink = tint;
  gl_PointSize = 2.0 * ratio * max(minPx, dot.z * pxPerM);
  gl_Position = projectionMatrix * modelViewMatrix * vec4(dot.xy, 0.0, 1.0);
}`;

const FRAGMENT = `
flat in vec4 ink;
void main() { color = ink; }`;

export class Dots {
  readonly points: Points<BufferGeometry, RawShaderMaterial>;
  readonly #uniforms = { pxPerM: { value: 1 }, minPx: { value: 1 }, ratio: { value: 1 } };
  #capacity = 0;
  #count = 0;
  #dots = new Float32Array(0);
  #tints = new Uint32Array(0);
  #isOpaque = true;

  constructor(order: number, min_px: number) {
    this.#uniforms.minPx.value = min_px;
    const look = material({
      vertex: VERTEX,
      fragment: FRAGMENT,
      uniforms: this.#uniforms,
      depth: false,
      transparent: true,
    });
    this.points = new Points(new BufferGeometry(), look);
    this.points.renderOrder = order;
    this.points.frustumCulled = false;
    this.points.matrixAutoUpdate = false;
    this.points.visible = false;
  }

  /** Starts over, with room for this many dots. */
  begin(capacity: number): void {
    this.#count = 0;
    this.#isOpaque = true;
    if (capacity <= this.#capacity) return;
    this.#capacity = capacity;
    this.#dots = new Float32Array(3 * capacity);
    this.#tints = new Uint32Array(capacity);
    const { geometry } = this.points;
    // Resized buffers need new handles in the driver: dispose() releases the old ones.
    geometry.dispose();
    geometry.setAttribute("dot", new BufferAttribute(this.#dots, 3).setUsage(DynamicDrawUsage));
    const bytes = new Uint8Array(this.#tints.buffer);
    geometry.setAttribute("tint", new BufferAttribute(bytes, 4, true).setUsage(DynamicDrawUsage));
  }

  add(x: number, y: number, half_m: number, tint: number): void {
    const i = this.#count++;
    this.#dots[3 * i] = x;
    this.#dots[3 * i + 1] = y;
    this.#dots[3 * i + 2] = half_m;
    this.#tints[i] = tint;
    if (tint >>> 24 < 255) this.#isOpaque = false;
  }

  end(): void {
    const { geometry, material: look } = this.points;
    this.points.visible = this.#count > 0;
    if (this.#count === 0) return;
    look.blending = this.#isOpaque ? NoBlending : NormalBlending;
    geometry.setDrawRange(0, this.#count);
    for (const [name, size] of [
      ["dot", 3],
      ["tint", 4],
    ] as const) {
      const attribute = geometry.getAttribute(name) as BufferAttribute;
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, size * this.#count);
      attribute.needsUpdate = true;
    }
  }

  /** `ratio`: pixels of the canvas for each of the page. */
  scale(pxPerM: number, ratio: number): void {
    this.#uniforms.pxPerM.value = pxPerM;
    this.#uniforms.ratio.value = ratio;
  }

  dispose(): void {
    this.points.geometry.dispose();
    this.points.material.dispose();
  }
}
