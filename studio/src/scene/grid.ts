/** Grid lines at round distances, to show the scale of a scene. */

import type { Extent, Camera } from "./camera";
import { PlaneCamera } from "./camera";
import { packColor, type Palette } from "./palette";
import type { Strokes } from "./strokes";

/** The smallest of 1, 2 and 5 times a power of ten that is not less. */
export function roundUp(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  const factor = [1, 2, 5, 10].find((f) => f * power >= value * 0.999999) ?? 10;
  return factor * power;
}

/** Multiples of a step between two numbers. */
export function multiples(lo: number, hi: number, step: number): number[] {
  const found: number[] = [];
  for (let i = Math.ceil(lo / step); i * step <= hi && found.length < 400; i++) found.push(i * step);
  return found;
}

/** The grid of the visible part of the plane, with its step. */
export function planeGrid(
  camera: PlaneCamera,
  width_px: number,
  height_px: number,
): { xs: number[]; ys: number[]; step: number } {
  const step = roundUp(90 * camera.mPerPx);
  const [x0, y1] = camera.at(0, 0);
  const [x1, y0] = camera.at(width_px, height_px);
  return { xs: multiples(x0, x1, step), ys: multiples(y0, y1, step), step };
}

/** The floor of a scene in space, with the step of its grid. */
export function spaceGrid({ low: lo, high: hi }: Extent): { xs: number[]; ys: number[]; step: number; z: number } {
  const size = Math.max(hi[0] - lo[0], hi[1] - lo[1], 1e-6);
  const step = roundUp(size / 14);
  const out = (k: 0 | 1): [number, number] => [Math.floor(lo[k] / step) * step, Math.ceil(hi[k] / step) * step];
  return { xs: multiples(...out(0), step), ys: multiples(...out(1), step), step, z: lo[2] };
}

/** Draws the grid of the visible part. */
export function drawGrid(
  strokes: Strokes,
  camera: Camera,
  extent: Extent,
  size_px: [number, number],
  palette: Palette,
): void {
  const tint = packColor(palette.faint, palette.isDark ? 0.22 : 0.25);
  strokes.begin();
  if (camera instanceof PlaneCamera) {
    const { xs, ys } = planeGrid(camera, ...size_px);
    const [x0, y1] = camera.at(0, 0);
    const [x1, y0] = camera.at(...size_px);
    for (const x of xs) strokes.piece([x, y0, 0], [x, y1, 0], 1, 0, tint);
    for (const y of ys) strokes.piece([x0, y, 0], [x1, y, 0], 1, 0, tint);
  } else {
    const { xs, ys, z } = spaceGrid(extent);
    const [x0, x1, y0, y1] = [xs[0]!, xs.at(-1)!, ys[0]!, ys.at(-1)!];
    for (const x of xs) strokes.piece([x, y0, z], [x, y1, z], 1, 0, tint);
    for (const y of ys) strokes.piece([x0, y, z], [x1, y, z], 1, 0, tint);
  }
  strokes.end();
}
