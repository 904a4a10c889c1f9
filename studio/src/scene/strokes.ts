/** Lines whose width is given in pixels or in meters: trails, beams and marks, in the plane and in space. */

import { material } from "./material";
import { CORNER, Quads } from "./quads";

const VERTEX = `
in vec3 from;
in vec3 to;
in vec4 form;      // width in pixels, width in meters, meters before this piece, 1 if dashed
in vec4 tint;
uniform vec2 canvas;
uniform float pxPerM;
out float along;
out float across;
flat out float halfWidth;
flat out float dashed;
flat out float length_;
flat out vec4 ink;
${CORNER}
void main() {
  vec2 position = corner();
  vec4 a = projectionMatrix * modelViewMatrix * vec4(from, 1.0);
  vec4 b = projectionMatrix * modelViewMatrix * vec4(to, 1.0);
  // A point behind the camera has no position on the canvas: clip the piece there.
  float near = 1e-4;
  if (a.w < near && b.w < near) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  if (a.w < near) a = mix(b, a, (b.w - near) / (b.w - a.w));
  if (b.w < near) b = mix(a, b, (a.w - near) / (a.w - b.w));
  vec2 pa = a.xy / a.w * canvas * 0.5, pb = b.xy / b.w * canvas * 0.5;
  float width = max(form.x, form.y * pxPerM);
  vec2 path = pb - pa;
  length_ = length(path);
  vec2 dir = length_ > 1e-6 ? path / length_ : vec2(1.0, 0.0);
  vec2 side = vec2(-dir.y, dir.x);
  halfWidth = 0.5 * width;
  float reach = halfWidth + 1.0;
  float end = position.x < 0.0 ? 0.0 : 1.0;
  vec2 px = mix(pa, pb, end) + dir * (end * 2.0 - 1.0) * reach + side * position.y * 2.0 * reach;
  along = end * length_ + (end * 2.0 - 1.0) * reach;
  across = position.y * 2.0 * reach;
  dashed = form.w > 0.5 ? form.z * pxPerM : -1.0;
  ink = tint;
  vec4 at = mix(a, b, end);
  gl_Position = vec4(px / (canvas * 0.5) * at.w, at.z, at.w);
}`;

const FRAGMENT = `
in float along;
in float across;
flat in float halfWidth;
flat in float dashed;
flat in float length_;
flat in vec4 ink;
void main() {
  // Round ends, so that pieces of a bent line leave no gap.
  float beyond = max(max(-along, along - length_), 0.0);
  float d = length(vec2(beyond, across)) - halfWidth;
  float alpha = clamp(0.5 - d, 0.0, 1.0) * ink.a;
  if (dashed >= 0.0 && mod(along + dashed, 10.0) > 6.0) alpha = 0.0;
  if (alpha <= 0.0) discard;
  color = vec4(ink.rgb, alpha);
}`;

export class Strokes {
  readonly quads: Quads;
  readonly #uniforms = { canvas: { value: [1, 1] }, pxPerM: { value: 1 } };
  #count = 0;

  constructor(order: number) {
    const look = material({
      vertex: VERTEX,
      fragment: FRAGMENT,
      uniforms: this.#uniforms,
      depth: false,
      transparent: true,
    });
    const columns = { from: { size: 3 }, to: { size: 3 }, form: { size: 4 }, tint: { size: 4, bytes: true } } as const;
    this.quads = new Quads(columns, look);
    this.quads.mesh.renderOrder = order;
  }

  scale(pxPerM: number, width_px: number, height_px: number): void {
    this.#uniforms.pxPerM.value = pxPerM;
    this.#uniforms.canvas.value = [width_px, height_px];
  }

  begin(): void {
    this.#count = 0;
  }

  /** One straight piece; `before_m` continues the dashes of the previous piece. */
  piece(
    a: ArrayLike<number>,
    b: ArrayLike<number>,
    width_px: number,
    width_m: number,
    tint: number,
    dashed = false,
    before_m = 0,
  ): void {
    const i = this.#count++;
    this.quads.reserve(this.#count);
    const from = this.quads.floats("from");
    const to = this.quads.floats("to");
    for (let k = 0; k < 3; k++) {
      from[3 * i + k] = a[k] ?? 0;
      to[3 * i + k] = b[k] ?? 0;
    }
    const form = this.quads.floats("form");
    form[4 * i] = width_px;
    form[4 * i + 1] = width_m;
    form[4 * i + 2] = before_m;
    form[4 * i + 3] = dashed ? 1 : 0;
    this.quads.words("tint")[i] = tint;
  }

  path(points: readonly ArrayLike<number>[], width_px: number, tint: number, dashed = false): void {
    let before_m = 0;
    for (let i = 1; i < points.length; i++) {
      const [a, b] = [points[i - 1]!, points[i]!];
      this.piece(a, b, width_px, 0, tint, dashed, before_m);
      before_m += Math.hypot(b[0]! - a[0]!, b[1]! - a[1]!, (b[2] ?? 0) - (a[2] ?? 0));
    }
  }

  dot(at: ArrayLike<number>, width_px: number, tint: number): void {
    this.piece(at, at, width_px, 0, tint);
  }

  end(): void {
    this.quads.commit(this.#count);
  }
}
