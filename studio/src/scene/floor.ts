/** The occupancy grid: its run-length code, and the texture that shows it. */

import {
  DataTexture,
  Mesh,
  NearestFilter,
  NearestMipmapNearestFilter,
  PlaneGeometry,
  type RawShaderMaterial,
} from "three";
import type { OccupancyGrid } from "../protocol";
import { material } from "./material";
import type { Palette, Rgb } from "./palette";

/** Decodes the runs of a floor to one code per box. Boxes without a run are unknown (2). */
export function boxesOf(floor: Pick<OccupancyGrid, "width" | "height" | "runs">): Uint8Array {
  const boxes = new Uint8Array(floor.width * floor.height).fill(2);
  let at = 0;
  for (let i = 0; i + 1 < floor.runs.length && at < boxes.length; i += 2) {
    const end = Math.min(boxes.length, at + floor.runs[i + 1]!);
    boxes.fill(floor.runs[i]!, at, end);
    at = end;
  }
  return boxes;
}

const VERTEX = `
in vec3 position;
in vec2 uv;
uniform vec3 origin;   // x, y, yaw
uniform vec2 size;
out vec2 at;
void main() {
  at = uv;
  vec2 p = uv * size;
  float c = cos(origin.z), s = sin(origin.z);
  vec2 place = origin.xy + vec2(c * p.x - s * p.y, s * p.x + c * p.y);
  gl_Position = projectionMatrix * modelViewMatrix * vec4(place, 0.0, 1.0);
}`;

const FRAGMENT = `
in vec2 at;
uniform sampler2D boxes;
void main() { color = vec4(texture(boxes, at).rgb, 1.0); }`;

export class FloorLayer {
  readonly mesh: Mesh<PlaneGeometry, RawShaderMaterial>;
  readonly #boxes: Uint8Array;
  readonly #texture: DataTexture;

  constructor(floor: OccupancyGrid) {
    this.#boxes = boxesOf(floor);
    const pixels = new Uint8Array(4 * this.#boxes.length);
    const texture = new DataTexture(pixels, floor.width, floor.height);
    texture.magFilter = NearestFilter;
    // From far away, sampling single boxes would flicker; one sample of a mipmap is cheap in software renderers too.
    texture.minFilter = NearestMipmapNearestFilter;
    texture.generateMipmaps = true;
    this.#texture = texture;
    const uniforms = {
      boxes: { value: texture },
      origin: { value: [floor.origin_m[0], floor.origin_m[1], floor.yaw_rad] },
      size: { value: [floor.width * floor.box_m, floor.height * floor.box_m] },
    };
    const look = material({ vertex: VERTEX, fragment: FRAGMENT, uniforms, depth: false, transparent: false });
    this.mesh = new Mesh(new PlaneGeometry(1, 1), look);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 0;
  }

  paint(palette: Palette): void {
    const colors: Rgb[] = [palette.free, palette.wall, palette.unknown];
    const words = new Uint32Array(this.#texture.image.data!.buffer);
    const packed = colors.map(([r, g, b]) => ((255 << 24) | (b << 16) | (g << 8) | r) >>> 0);
    for (let i = 0; i < this.#boxes.length; i++) words[i] = packed[this.#boxes[i]!] ?? packed[2]!;
    this.#texture.needsUpdate = true;
  }

  dispose(): void {
    this.#texture.dispose();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}
