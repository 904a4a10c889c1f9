/** The lines behind a plan: latitudes and longitudes on earth, else round distances; as in `draw`'s `plan/graticule.rs`. */

import { number } from "../format";
import type { EarthChart, Traffic } from "../protocol";
import type { PlaneCamera } from "./camera";
import { latLonDeg, wrapDeg } from "./earth";
import { multiples, roundUp } from "./grid";
import { unitsOf } from "./plan-units";

/** Steps of latitudes and longitudes in arc seconds. */
const STEPS_ARC_S = [
  1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1200, 1800, 3600, 7200, 18_000, 36_000, 54_000, 72_000, 108_000, 162_000,
  324_000,
];
/** Points of a line, and steps of the secant method that find each of them. */
const POINTS = 9;
const STEPS = 4;
/** Least distance of two lines. */
const MIN_SPACING_PX = 100;

export interface GraticuleLine {
  /** Lines of equal longitude go up, and have their labels below. */
  goesUp: boolean;
  label: string;
  /** Points in meters, from the lower or left edge on. */
  points_m: [number, number][];
}

/** Returns the lines of what a camera shows. */
export function graticule(
  traffic: Traffic,
  camera: PlaneCamera,
  [width_px, height_px]: readonly [number, number],
): GraticuleLine[] {
  const [x0, y1] = camera.at(0, 0);
  const [x1, y0] = camera.at(width_px, height_px);
  if (traffic.chart) {
    const window = { chart: traffic.chart, low: [x0, y0], high: [x1, y1] } as const;
    return [...earthLines(window, true, width_px), ...earthLines(window, false, height_px)];
  }
  const [unit, unit_m] = unitsOf(traffic).distance(Math.max(x1 - x0, y1 - y0));
  const step_m = roundUp((MIN_SPACING_PX * camera.mPerPx) / unit_m) * unit_m;
  const label = (value_m: number): string => `${number(Number((value_m / unit_m).toPrecision(10)))} ${unit}`;
  const up = multiples(x0, x1, step_m).map((x): GraticuleLine => {
    return { goesUp: true, label: label(x), points_m: [[x, y0], [x, y1]] }; // prettier-ignore
  });
  const across = multiples(y0, y1, step_m).map((y): GraticuleLine => {
    return { goesUp: false, label: label(y), points_m: [[x0, y], [x1, y]] }; // prettier-ignore
  });
  return [...up, ...across];
}

interface Window {
  readonly chart: EarthChart;
  readonly low: readonly [number, number];
  readonly high: readonly [number, number];
}

function earthLines(window: Window, goesUp: boolean, length_px: number): GraticuleLine[] {
  const { chart, low, high } = window;
  const place = (along: number, beside: number): [number, number] => {
    const [across, upward] = goesUp ? [along, beside] : [beside, along];
    return [low[0] + across * (high[0] - low[0]), low[1] + upward * (high[1] - low[1])];
  };
  const value = (along: number, beside: number): number => {
    const [lat, lon] = latLonDeg(chart, ...place(along, beside));
    // Longitudes go on beyond 180 degrees, so that they grow across the picture.
    return goesUp ? chart.origin_deg[1] + wrapDeg(lon - chart.origin_deg[1]) : lat;
  };
  const rows = Array.from({ length: POINTS }, (_, k) => k / (POINTS - 1));
  const ends = rows.map((beside) => [value(0, beside), value(1, beside)] as const);
  const [from, to] = [Math.min(...ends.map(([a]) => a)), Math.max(...ends.map(([, b]) => b))];
  const min_arc_s = ((to - from) * 3600 * MIN_SPACING_PX) / Math.max(1, length_px);
  const step_arc_s = STEPS_ARC_S.find((step) => step >= min_arc_s) ?? STEPS_ARC_S.at(-1)!;
  return multiples(from * 3600, to * 3600, step_arc_s).flatMap((arc_s): GraticuleLine[] => {
    const points_m = rows.flatMap((beside, k): [number, number][] => {
      const along = crossing((t) => value(t, beside) - arc_s / 3600, ends[k]!, arc_s / 3600);
      return along === null ? [] : [place(along, beside)];
    });
    return points_m.length > 1 ? [{ goesUp, label: angleLabel(arc_s / 3600, step_arc_s, goesUp), points_m }] : [];
  });
}

/** Where a nearly linear function is zero between 0 and 1, whose ends have these values; null if nowhere. */
function crossing(of: (t: number) => number, [low, high]: readonly [number, number], at: number): number | null {
  if (at < low || at > high) return null;
  let [a, b] = [0, 1];
  let [fa, fb] = [low - at, high - at];
  for (let i = 0; i < STEPS && fb !== fa; i++) {
    const t = b - (fb * (b - a)) / (fb - fa);
    [a, fa, b, fb] = [b, fb, t, of(t)];
  }
  return Math.min(1, Math.max(0, b));
}

/** A latitude or longitude with the digits that multiples of a step need. */
export function angleLabel(value_deg: number, step_arc_s: number, isLongitude: boolean): string {
  const wrapped = isLongitude ? wrapDeg(value_deg) : value_deg;
  const arc_s = Math.round(Math.abs(wrapped) * 3600);
  const sides = isLongitude ? "WE" : "SN";
  // On the date line, neither east nor west is right.
  const side = arc_s === 0 || arc_s === 180 * 3600 ? "" : wrapped < 0 ? sides[0] : sides[1];
  const two = (n: number): string => String(n).padStart(2, "0");
  const [degrees, minutes, seconds] = [Math.floor(arc_s / 3600), Math.floor(arc_s / 60) % 60, arc_s % 60];
  if (step_arc_s >= 3600) return `${degrees}°${side}`;
  if (step_arc_s >= 60) return `${degrees}°${two(minutes)}′${side}`;
  return `${degrees}°${two(minutes)}′${two(seconds)}″${side}`;
}
