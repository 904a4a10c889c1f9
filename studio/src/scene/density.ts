/** Many agents seen from far away: the number in each cell of a grid, or the mean of a value there, as a heat. */

import { DataTexture, Mesh, NearestFilter, PlaneGeometry, type RawShaderMaterial } from "three";
import type { Frame } from "../decode";
import type { Bodies } from "../state/bodies";
import type { PlaneCamera } from "./camera";
import { roundUp } from "./grid";
import { material } from "./material";
import { packColor, type Palette } from "./palette";
import { grayOf, ScaleRange, scaleColor } from "./scale";

/** Minimum side of a cell on the screen. */
const MIN_CELL_PX = 7;
/** Maximum number of cells along each axis: a grid over more than the screen is cut there. */
const MAX_CELLS = 1024;
/** Fewer agents than this can be told apart however far away they are. */
const MIN_CROWD = 2000;
/** Agents of this size on the screen, or a smaller one, are no more than dots. */
const MAX_DOT_PX = 4;
const STEPS = 256;

const VERTEX = `
in vec3 position;
in vec2 uv;
uniform vec4 area;     // x, y, width, height
out vec2 at;
void main() {
  at = uv;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(area.xy + uv * area.zw, 0.0, 1.0);
}`;

const FRAGMENT = `
in vec2 at;
uniform sampler2D cells;
void main() {
  color = texture(cells, at);
  if (color.a == 0.0) discard;
}`;

/** A grid of cells over a part of the plane. */
interface Cells {
  side_m: number;
  /** The lower left corner. */
  x: number;
  y: number;
  columns: number;
  rows: number;
}

/** Returns whether agents are shown as a density by itself. */
export function isCrowd(bodies: Bodies, agentSize_m: number, pxPerM: number): boolean {
  return bodies.agents.length >= MIN_CROWD && agentSize_m * pxPerM <= MAX_DOT_PX;
}

/** Returns whether symbols that keep their size on the screen would cover it, as they are so many there. */
export function doSymbolsCrowd(
  frame: Frame,
  agents: Uint32Array,
  camera: PlaneCamera,
  [width_px, height_px]: readonly [number, number],
  symbol_px: number,
): boolean {
  if (agents.length < MIN_CROWD) return false;
  const [left, top] = camera.at(0, 0);
  const [right, bottom] = camera.at(width_px, height_px);
  const { dimensions: d, positions_m } = frame;
  let visible = 0;
  for (const i of agents) {
    const x = positions_m[d * i]!;
    const y = positions_m[d * i + 1]!;
    if (x >= left && x <= right && y >= bottom && y <= top) visible++;
  }
  return visible >= MIN_CROWD && visible * symbol_px * symbol_px > width_px * height_px;
}

/** The cells of the visible part of the plane, at round multiples of their side. */
export function cellsOf(camera: PlaneCamera, [width_px, height_px]: readonly [number, number]): Cells {
  const side_m = roundUp(MIN_CELL_PX * camera.mPerPx);
  const [left, top] = camera.at(0, 0);
  const [right, bottom] = camera.at(width_px, height_px);
  const [column, row] = [Math.floor(left / side_m), Math.floor(bottom / side_m)];
  return {
    side_m,
    x: column * side_m,
    y: row * side_m,
    columns: Math.min(MAX_CELLS, Math.ceil(right / side_m) - column),
    rows: Math.min(MAX_CELLS, Math.ceil(top / side_m) - row),
  };
}

/** Counts agents in cells; also sums up their values where there are some. */
export function countIn(
  { side_m, x, y, columns, rows }: Cells,
  frame: Frame,
  agents: Uint32Array,
  values: Float32Array | null,
): { counts: Uint32Array; sums: Float64Array } {
  const counts = new Uint32Array(columns * rows);
  const sums = new Float64Array(values ? counts.length : 0);
  const { dimensions: d, positions_m } = frame;
  for (const i of agents) {
    const column = Math.floor((positions_m[d * i]! - x) / side_m);
    const row = Math.floor((positions_m[d * i + 1]! - y) / side_m);
    if (!(column >= 0 && column < columns && row >= 0 && row < rows)) continue;
    const cell = row * columns + column;
    counts[cell]!++;
    if (values) sums[cell]! += values[i]!;
  }
  return { counts, sums };
}

export class DensityLayer {
  readonly mesh: Mesh<PlaneGeometry, RawShaderMaterial>;
  readonly range = new ScaleRange();
  readonly #uniforms = { cells: { value: null as DataTexture | null }, area: { value: [0, 0, 1, 1] } };
  #texture: DataTexture | null = null;
  #side_m = 0;

  constructor() {
    const look = material({
      vertex: VERTEX,
      fragment: FRAGMENT,
      uniforms: this.#uniforms,
      depth: false,
      transparent: true,
    });
    this.mesh = new Mesh(new PlaneGeometry(1, 1), look);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 1.5;
    this.mesh.visible = false;
  }

  /** The side of a cell, in meters. */
  get side_m(): number {
    return this.#side_m;
  }

  /** Draws the agents of a frame; `ends` are those of the scale of their values, if they have some. */
  draw(
    cells: Cells,
    frame: Frame,
    bodies: Bodies,
    scale: { values: Float32Array; ends: readonly [number, number] } | null,
    palette: Palette,
  ): void {
    const { counts, sums } = countIn(cells, frame, bodies.agents, scale?.values ?? null);
    // Other cells hold other numbers, so their scale begins anew.
    if (cells.side_m !== this.#side_m) this.range.reset();
    this.#side_m = cells.side_m;
    if (!scale) this.range.include(counts);
    const [low, high] = scale?.ends ?? this.range.ends;
    const steps = Uint32Array.from({ length: STEPS }, (_, step) =>
      packColor(scaleColor(step / (STEPS - 1), palette), 1),
    );
    const gray = packColor(grayOf(palette), 1);
    const texture = this.#textureOf(cells);
    const words = new Uint32Array(texture.image.data!.buffer);
    for (let cell = 0; cell < counts.length; cell++) {
      const count = counts[cell]!;
      const value = scale ? sums[cell]! / count : count;
      const step = Math.round(((STEPS - 1) * (value - low)) / (high - low));
      if (count === 0) words[cell] = 0;
      else words[cell] = Number.isFinite(step) ? steps[Math.min(STEPS - 1, Math.max(0, step))]! : gray;
    }
    texture.needsUpdate = true;
    this.#uniforms.area.value = [cells.x, cells.y, cells.columns * cells.side_m, cells.rows * cells.side_m];
  }

  #textureOf({ columns, rows }: Cells): DataTexture {
    const known = this.#texture;
    if (known && known.image.width === columns && known.image.height === rows) return known;
    known?.dispose();
    const texture = new DataTexture(new Uint8Array(4 * columns * rows), columns, rows);
    texture.magFilter = NearestFilter;
    texture.minFilter = NearestFilter;
    this.#texture = this.#uniforms.cells.value = texture;
    return texture;
  }

  dispose(): void {
    this.#texture?.dispose();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}
