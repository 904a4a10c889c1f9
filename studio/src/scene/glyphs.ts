/** Bodies of the plane: one draw call of quads, in whose fragments discs, boxes, darts and rods are drawn smoothly. */

import { material } from "./material";
import type { Palette } from "./palette";
import { CORNER, Quads } from "./quads";

/** Shapes of a quad. */
export const DISC = 0;
export const BOX = 1;
export const DART = 2;
export const ROD = 3;

const VERTEX = `
in vec3 pose;      // x, y, heading
in vec4 form;      // half length, half width, kind, minimum half length in pixels
in vec4 tint;
uniform float pxPerM;
out vec2 at;
flat out vec2 extent;
flat out float kind;
flat out float agent;
flat out vec4 ink;
${CORNER}
void main() {
  vec2 extentPx = form.xy * pxPerM;
  float grown = max(1.0, form.w / max(1e-9, max(extentPx.x, extentPx.y)));
  extentPx *= grown;
  // A thin rod is widened at its ends too, or a line of many pieces would look dashed.
  if (form.z > 2.5) extentPx.x += max(0.0, 0.6 - extentPx.y);
  extentPx = max(extentPx, vec2(0.6));
  float rim = max(extentPx.x, extentPx.y) < 2.0 ? 0.0 : 1.0;
  vec2 at_ = corner() * 2.0 * (extentPx + rim);
  float c = cos(pose.z), s = sin(pose.z);
  vec2 turned = vec2(c * at_.x - s * at_.y, s * at_.x + c * at_.y) / pxPerM;
  at = at_;
  extent = extentPx;
  kind = form.z;
  agent = form.w > 0.0 ? 1.0 : 0.0;
  ink = tint;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(pose.xy + turned, 0.0, 1.0);
}`;

const FRAGMENT = `
in vec2 at;
flat in vec2 extent;
flat in float kind;
flat in float agent;
flat in vec4 ink;
uniform vec3 edge;
float box(vec2 p, vec2 half_) {
  vec2 q = abs(p) - half_;
  return length(max(q, 0.0)) + min(max(q.x, q.y), 0.0);
}
float dart(vec2 p) {
  vec2 q = vec2(p.x, abs(p.y));
  vec2 tip = vec2(extent.x, 0.0), wing = vec2(-extent.x, extent.y), notch = vec2(-0.55 * extent.x, 0.0);
  vec2 a = normalize(vec2(extent.y, 2.0 * extent.x));
  vec2 back = wing - notch;
  vec2 b = normalize(vec2(-back.y, back.x));
  return max(dot(q - tip, a), dot(q - notch, b));
}
void main() {
  // A body of a few pixels needs no shape: a crowd is drawn as squares, which the rasterizer clips.
  if (max(extent.x, extent.y) < 2.0) {
    color = ink;
    return;
  }
  float d;
  if (kind < 0.5) d = length(at) - extent.x;
  else if (kind < 1.5) d = box(at, extent);
  else if (kind < 2.5) d = dart(at);
  else d = length(vec2(max(abs(at.x) - extent.x + extent.y, 0.0), at.y)) - extent.y;
  float inside = clamp(0.5 - d, 0.0, 1.0);
  if (inside <= 0.0) discard;
  float minHalf = min(extent.x, extent.y);
  vec3 body = ink.rgb;
  // A rim where there is room for one, and a tick toward the front of agents.
  float rim = clamp(d + 1.6, 0.0, 1.0) * smoothstep(3.0, 5.0, minHalf);
  body = mix(body, edge, rim * 0.6);
  if (agent > 0.5 && kind < 1.5) {
    float tick = 1.0 - clamp(abs(at.y) - max(0.6, 0.12 * minHalf) + 0.5, 0.0, 1.0);
    tick *= step(0.0, at.x) * smoothstep(3.0, 5.0, minHalf) * (1.0 - rim);
    float light = dot(ink.rgb, vec3(0.2126, 0.7152, 0.0722));
    body = mix(body, light > 0.55 ? vec3(0.0) : vec3(1.0), tick * 0.9);
  }
  // A nearly transparent body keeps a visible border.
  float alpha = max(ink.a, ink.a < 0.5 ? clamp(d + 1.5, 0.0, 1.0) * 0.55 : 0.0);
  color = vec4(body, inside * alpha);
}`;

export class Glyphs {
  readonly quads: Quads;
  readonly #uniforms = { pxPerM: { value: 1 }, edge: { value: [0, 0, 0] } };
  #count = 0;
  #pose!: Float32Array;
  #form!: Float32Array;
  #tint!: Uint32Array;

  constructor(order: number) {
    const look = material({
      vertex: VERTEX,
      fragment: FRAGMENT,
      uniforms: this.#uniforms,
      depth: false,
      transparent: true,
    });
    const columns = { pose: { size: 3 }, form: { size: 4 }, tint: { size: 4, bytes: true } } as const;
    this.quads = new Quads(columns, look);
    this.quads.mesh.renderOrder = order;
    this.begin(16);
  }

  scale(pxPerM: number, palette: Palette): void {
    this.#uniforms.pxPerM.value = pxPerM;
    this.#uniforms.edge.value = palette.isDark ? [1, 1, 1] : [0, 0, 0];
  }

  /** Starts over, with room for this many glyphs. */
  begin(capacity: number): void {
    this.#count = 0;
    this.quads.reserve(capacity);
    this.#pose = this.quads.floats("pose");
    this.#form = this.quads.floats("form");
    this.#tint = this.quads.words("tint");
  }

  add(
    x: number,
    y: number,
    heading: number,
    halfLength: number,
    halfWidth: number,
    kind: number,
    minPx: number,
    tint: number,
  ): void {
    const i = this.#count++;
    const p = 3 * i;
    this.#pose[p] = x;
    this.#pose[p + 1] = y;
    this.#pose[p + 2] = heading;
    const f = 4 * i;
    this.#form[f] = halfLength;
    this.#form[f + 1] = halfWidth;
    this.#form[f + 2] = kind;
    this.#form[f + 3] = minPx;
    this.#tint[i] = tint;
  }

  /** A rod between two positions. */
  rod(x0: number, y0: number, x1: number, y1: number, thickness: number, tint: number): void {
    const [dx, dy] = [x1 - x0, y1 - y0];
    const half = 0.5 * Math.hypot(dx, dy) + 0.5 * thickness;
    this.add(0.5 * (x0 + x1), 0.5 * (y0 + y1), Math.atan2(dy, dx), half, 0.5 * thickness, ROD, 0, tint);
  }

  end(): void {
    this.quads.commit(this.#count);
  }
}
