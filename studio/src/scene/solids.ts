/** Bodies of space: balls as shaded quads, boxes, cylinders and darts as small meshes, all instanced. */

import { BoxGeometry, CylinderGeometry, ConeGeometry, type BufferGeometry } from "three";
import { Instances } from "./instances";
import { material } from "./material";
import { CORNER, Quads } from "./quads";

const LIGHT = `
vec3 lit(vec3 base, vec3 normal) {
  float sun = max(0.0, dot(normal, normalize(vec3(0.35, 0.55, 0.75))));
  return base * (0.55 + 0.45 * sun) + 0.08 * pow(sun, 12.0);
}`;

const BALL_VERTEX = `
in vec4 ball;      // center, radius
in vec4 tint;
uniform float minOfDistance;
out vec2 at;
flat out vec3 center;
flat out float radius;
flat out vec4 ink;
${CORNER}
void main() {
  center = (modelViewMatrix * vec4(ball.xyz, 1.0)).xyz;
  radius = max(ball.w, -center.z * minOfDistance);
  at = corner() * 2.0;
  ink = tint;
  gl_Position = projectionMatrix * vec4(center + vec3(at * radius, 0.0), 1.0);
}`;

const BALL_FRAGMENT = (deep: boolean): string => `
in vec2 at;
flat in vec3 center;
flat in float radius;
flat in vec4 ink;
uniform mat4 projectionMatrix;
uniform float veil;
${LIGHT}
void main() {
  float r2 = dot(at, at);
  if (r2 > 1.0) discard;
  vec3 normal = vec3(at, sqrt(1.0 - r2));
  // Glass: an opaque rim shows the outline, the middle is clear.
  float alpha = ink.a < 0.99 ? ink.a * veil * mix(0.45, 2.2, r2 * r2) : 1.0;
  color = vec4(lit(ink.rgb, normal), min(1.0, alpha));
  ${deep ? "vec4 clip = projectionMatrix * vec4(center + radius * normal, 1.0); gl_FragDepth = 0.5 + 0.5 * clip.z / clip.w;" : ""}
}`;

const MESH_VERTEX = `
in vec3 position;
in vec3 normal;
in vec3 place;
in vec4 turn;      // quaternion
in vec3 size;
in vec4 tint;
out vec3 facing;
flat out vec4 ink;
vec3 turned(vec3 v) { return v + 2.0 * cross(turn.xyz, cross(turn.xyz, v) + turn.w * v); }
void main() {
  facing = mat3(modelViewMatrix) * turned(normal / size);
  ink = tint;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(place + turned(position * size), 1.0);
}`;

const MESH_FRAGMENT = `
in vec3 facing;
flat in vec4 ink;
uniform float veil;
${LIGHT}
void main() { color = vec4(lit(ink.rgb, normalize(facing)), ink.a < 0.99 ? ink.a * veil : 1.0); }`;

export type SolidKind = "ball" | "box" | "cylinder" | "dart";

/** Unit shapes: they end at half a meter from the middle along each axis. */
function unit(kind: Exclude<SolidKind, "ball">): BufferGeometry {
  if (kind === "box") return new BoxGeometry(1, 1, 1);
  if (kind === "cylinder") return new CylinderGeometry(0.5, 0.5, 1, 12).rotateX(Math.PI / 2);
  return new ConeGeometry(0.5, 1, 4).rotateZ(-Math.PI / 2);
}

/** Solids of one kind, either opaque or not. */
export class Solids {
  readonly instances: Instances | Quads;
  readonly #isBall: boolean;
  readonly #uniforms = { veil: { value: 1 }, minOfDistance: { value: 0 } };
  #count = 0;

  constructor(kind: SolidKind, transparent: boolean) {
    this.#isBall = kind === "ball";
    const vertex = this.#isBall ? BALL_VERTEX : MESH_VERTEX;
    const fragment = this.#isBall ? BALL_FRAGMENT(!transparent) : MESH_FRAGMENT;
    const look = material({ vertex, fragment, uniforms: this.#uniforms, depth: true, transparent });
    const tint = { size: 4, bytes: true } as const;
    this.instances =
      kind === "ball"
        ? new Quads({ ball: { size: 4 }, tint }, look)
        : new Instances(unit(kind), { place: { size: 3 }, turn: { size: 4 }, size: { size: 3 }, tint }, look);
    this.instances.mesh.renderOrder = transparent ? 5 : 1;
  }

  begin(): void {
    this.#count = 0;
  }

  /** Number of bodies since the last `begin`. */
  get count(): number {
    return this.#count;
  }

  #next(): number {
    this.instances.reserve(this.#count + 1);
    return this.#count++;
  }

  ball(x: number, y: number, z: number, radius: number, tint: number): void {
    const i = this.#next();
    const ball = this.instances.floats("ball");
    ball[4 * i] = x;
    ball[4 * i + 1] = y;
    ball[4 * i + 2] = z;
    ball[4 * i + 3] = radius;
    this.instances.words("tint")[i] = tint;
  }

  mesh(at: ArrayLike<number>, turn: ArrayLike<number>, size: readonly [number, number, number], tint: number): void {
    const i = this.#next();
    const place = this.instances.floats("place");
    const turns = this.instances.floats("turn");
    const sizes = this.instances.floats("size");
    for (let k = 0; k < 3; k++) {
      place[3 * i + k] = at[k]!;
      sizes[3 * i + k] = Math.max(1e-9, size[k]!);
    }
    for (let k = 0; k < 4; k++) turns[4 * i + k] = turn[k]!;
    this.instances.words("tint")[i] = tint;
  }

  /** Sets the minimum radius of balls, as a fraction of their distance: far ones stay visible. */
  setMinRadius(ofDistance: number): void {
    this.#uniforms.minOfDistance.value = ofDistance;
  }

  end(): void {
    // Hundreds of glass bodies behind each other would be a wall that hides the moving bodies among them.
    this.#uniforms.veil.value = Math.max(0.2, Math.min(1, Math.sqrt(300 / Math.max(1, this.#count))));
    this.instances.commit(this.#count);
  }
}

/** The shortest rotation of the third axis to a direction. */
export function rotationTo(dx: number, dy: number, dz: number): [number, number, number, number] {
  const length = Math.hypot(dx, dy, dz);
  if (length === 0) return [0, 0, 0, 1];
  const w = 1 + dz / length;
  if (w < 1e-9) return [1, 0, 0, 0];
  const [x, y] = [-dy / length, dx / length];
  const size = Math.hypot(x, y, w);
  return [x / size, y / size, 0, w / size];
}
