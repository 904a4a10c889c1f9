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
import { packColor, type Palette, type Rgb } from "./palette";

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

// A box of the texture is as opaque as it is a wall. From far away, where a pixel covers many boxes, thin walls would fade
// with the share of the pixel that they have: they are drawn stronger.
const FRAGMENT = `
in vec2 at;
uniform sampler2D boxes;
uniform vec3 wall;
void main() {
  vec4 found = texture(boxes, at);
  color = vec4(mix(found.rgb, wall, found.a < 0.99 ? min(1.0, 2.0 * found.a) : 1.0), 1.0);
}`;

/** Walls alone, over what is drawn on the floor. */
const WALLS_FRAGMENT = `
in vec2 at;
uniform sampler2D boxes;
uniform vec3 wall;
void main() {
  float share = min(1.0, 2.0 * texture(boxes, at).a);
  if (share < 0.05) discard;
  color = vec4(wall, share);
}`;

export class FloorLayer {
  readonly mesh: Mesh<PlaneGeometry, RawShaderMaterial>;
  /** The walls over a layer that covers the floor; not visible unless there is one. */
  readonly walls: Mesh<PlaneGeometry, RawShaderMaterial>;
  readonly #wall = { value: [0, 0, 0] };
  readonly #ink = { value: [0, 0, 0] };
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
      wall: this.#wall,
      origin: { value: [floor.origin_m[0], floor.origin_m[1], floor.yaw_rad] },
      size: { value: [floor.width * floor.box_m, floor.height * floor.box_m] },
    };
    const look = material({ vertex: VERTEX, fragment: FRAGMENT, uniforms, depth: false, transparent: false });
    this.mesh = new Mesh(new PlaneGeometry(1, 1), look);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 0;
    const overlay = material({
      vertex: VERTEX,
      fragment: WALLS_FRAGMENT,
      uniforms: { ...uniforms, wall: this.#ink },
      depth: false,
      transparent: true,
    });
    this.walls = new Mesh(this.mesh.geometry, overlay);
    this.walls.frustumCulled = false;
    this.walls.renderOrder = 1.7;
    this.walls.visible = false;
  }

  paint(palette: Palette): void {
    const colors: Rgb[] = [palette.free, palette.wall, palette.unknown];
    const words = new Uint32Array(this.#texture.image.data!.buffer);
    const packed = colors.map((color) => packColor(color, color === palette.wall ? 1 : 0));
    this.#wall.value = palette.wall.map((part) => part / 255);
    // Over colors they have to be as dark as can be, where the theme is light.
    this.#ink.value = (palette.isDark ? palette.background : palette.ink).map((part) => part / 255);
    for (let i = 0; i < this.#boxes.length; i++) words[i] = packed[this.#boxes[i]!] ?? packed[2]!;
    this.#texture.needsUpdate = true;
  }

  dispose(): void {
    this.#texture.dispose();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
    this.walls.material.dispose();
  }
}
