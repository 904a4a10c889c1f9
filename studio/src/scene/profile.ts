/** The vertical profile below a plan: altitudes over the same distances east, seen from the south. */

import { multiples, roundUp } from "./grid";
import { css, type Palette } from "./palette";
import { cssOfTint, type Aircraft } from "./plan";
import type { PlanUnits } from "./plan-units";
import type { WordsContext } from "./plan-words";
import { areaColor } from "./traffic-areas";

/** Height as a part of that of the view, and its limits; a lower view has no profile. */
const HEIGHT_PART = 0.22;
const HEIGHT_PX = [70, 150] as const;
const MIN_VIEW_PX = 260;
/** Margin above and below, as a part of the range of altitudes. */
const MARGIN_PART = 0.15;
/** Least range of altitudes, so that a level flight is no mountain. */
const MIN_RANGE_M = 300;
const LABEL_SPACING_PX = 24;

/** The height of the profile in a view of a height. */
export function profileHeight_px(view_px: number): number {
  if (view_px < MIN_VIEW_PX) return 0;
  return Math.round(Math.min(HEIGHT_PX[1], Math.max(HEIGHT_PX[0], HEIGHT_PART * view_px)));
}

/** The altitudes of a profile, with a margin: those of aircraft, starts and areas. */
export function altitudeRange_m({ scene, painter }: Pick<WordsContext, "scene" | "painter">): [number, number] {
  let [low, high] = [Infinity, -Infinity];
  const include = (altitude_m: number): void => {
    low = Math.min(low, altitude_m);
    high = Math.max(high, altitude_m);
  };
  for (const { altitude_m } of painter.aircraft()) include(altitude_m);
  for (const { at_m, shape } of scene.bodies) if (shape.type !== "line") include(at_m[2]);
  for (const { area } of painter.areas)
    for (const limit_m of [area.low_m, area.high_m]) if (limit_m !== null) include(limit_m);
  if (!Number.isFinite(low)) return [0, MIN_RANGE_M];
  const missing = Math.max(0, MIN_RANGE_M - (high - low));
  const margin = MARGIN_PART * (high - low + missing) + 0.5 * missing;
  // Nothing is below the ground unless traffic is there.
  return [low >= 0 ? Math.max(0, low - margin) : low - margin, high + margin];
}

export function drawProfile(pen: CanvasRenderingContext2D, context: WordsContext, units: PlanUnits): void {
  const { size_px, profile_px, palette, painter, camera } = context;
  const top = size_px[1] - profile_px;
  const range_m = altitudeRange_m(context);
  const yOf = (altitude_m: number): number =>
    size_px[1] - ((altitude_m - range_m[0]) / (range_m[1] - range_m[0])) * profile_px;
  pen.save();
  pen.fillStyle = css(palette.free);
  pen.fillRect(0, top, size_px[0], profile_px);
  pen.strokeStyle = css(palette.faint, 0.6);
  pen.lineWidth = 1;
  pen.beginPath();
  pen.moveTo(0, top + 0.5);
  pen.lineTo(size_px[0], top + 0.5);
  pen.stroke();
  pen.beginPath();
  pen.rect(0, top + 1, size_px[0], profile_px);
  pen.clip();
  drawLevels(pen, context, units, range_m, yOf);
  drawBands(pen, context, yOf);
  const ahead_s = painter.lookahead_s;
  for (const aircraft of painter.aircraft()) {
    const isFocus = aircraft.index === context.selected || aircraft.index === context.hovered;
    drawAircraft(pen, aircraft, { ahead_s, yOf, isFocus, palette, xOf: (x_m) => camera.project(x_m, 0)[0] }, cssOfTint(painter.tintOf(aircraft.index))); // prettier-ignore
  }
  pen.restore();
}

function drawLevels(
  pen: CanvasRenderingContext2D,
  { size_px, profile_px, palette }: WordsContext,
  units: PlanUnits,
  range_m: readonly [number, number],
  yOf: (altitude_m: number) => number,
): void {
  const unit_m = units.altitudeUnit_m;
  const step_m = roundUp((range_m[1] - range_m[0]) / unit_m / Math.max(1, profile_px / LABEL_SPACING_PX)) * unit_m;
  pen.textAlign = "left";
  for (const altitude_m of multiples(range_m[0], range_m[1], step_m)) {
    const y = yOf(altitude_m);
    pen.strokeStyle = css(palette.faint, 0.22);
    pen.beginPath();
    pen.moveTo(0, y);
    pen.lineTo(size_px[0], y);
    pen.stroke();
    if (y < size_px[1] - profile_px + 8 || y > size_px[1] - 6) continue;
    pen.fillStyle = css(palette.faint);
    pen.fillText(units.level(altitude_m), 4, y);
  }
}

function drawBands(
  pen: CanvasRenderingContext2D,
  { painter, camera, palette, size_px, profile_px }: WordsContext,
  yOf: (altitude_m: number) => number,
): void {
  const color = areaColor(palette);
  for (const { area, low_m, high_m } of painter.areas) {
    const [left, right] = [camera.project(low_m[0], 0)[0], camera.project(high_m[0], 0)[0]];
    const above = area.high_m === null ? size_px[1] - profile_px : yOf(area.high_m);
    const below = area.low_m === null ? size_px[1] : yOf(area.low_m);
    pen.strokeStyle = css(color, 0.9);
    pen.setLineDash(area.is_fence ? [6, 4] : []);
    pen.strokeRect(left, above, right - left, below - above);
    pen.fillStyle = css(color, 0.14);
    if (!area.is_fence) pen.fillRect(left, above, right - left, below - above);
  }
  pen.setLineDash([]);
}

interface ProfileScale {
  ahead_s: number;
  isFocus: boolean;
  palette: Palette;
  xOf(x_m: number): number;
  yOf(altitude_m: number): number;
}

/** A dot, because an aircraft that comes or goes has no heading from here. */
function drawAircraft(
  pen: CanvasRenderingContext2D,
  { x_m, altitude_m, velocity_m_s: v }: Aircraft,
  { ahead_s, isFocus, palette, xOf, yOf }: ProfileScale,
  color: string,
): void {
  const [x, y] = [xOf(x_m), yOf(altitude_m)];
  pen.strokeStyle = pen.fillStyle = color;
  pen.lineWidth = 1.5;
  if (v) {
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(xOf(x_m + ahead_s * v[0]), yOf(altitude_m + ahead_s * v[2]));
    pen.stroke();
  }
  pen.beginPath();
  pen.arc(x, y, 3.5, 0, 2 * Math.PI);
  pen.fill();
  if (!isFocus) return;
  pen.strokeStyle = css(palette.accent);
  pen.lineWidth = 2;
  pen.beginPath();
  pen.arc(x, y, 8, 0, 2 * Math.PI);
  pen.stroke();
}
