/** Colors for numbers and for categories: perceptually uniform, and told apart by color-blind readers. */

import { roundUp } from "./grid";
import type { Palette, Rgb } from "./palette";

/** Viridis at equal steps. */
const VIRIDIS: readonly Rgb[] = [
  [68, 1, 84],
  [72, 40, 120],
  [62, 74, 137],
  [49, 104, 142],
  [38, 130, 142],
  [31, 158, 137],
  [53, 183, 121],
  [109, 205, 89],
  [180, 222, 44],
  [253, 231, 37],
];

/**
 * The parts of viridis that stand out from a light and from a dark floor, from the least value to the greatest; without its
 * darkest colors on a light floor, where dark walls lie over them.
 */
const LIGHT_SPAN = [0.95, 0.33] as const;
const DARK_SPAN = [0.16, 1] as const;

/** Okabe and Ito's colors in the order in which the server gives them to bodies, and two more. */
export const CATEGORIES: readonly Rgb[] = [
  [0, 114, 178],
  [213, 94, 0],
  [0, 158, 115],
  [204, 121, 167],
  [230, 159, 0],
  [86, 180, 233],
  [139, 90, 43],
  [120, 94, 240],
];

/** The color of a fraction from 0 to 1: darker on a light floor, lighter on a dark one, the greater it is. */
export function scaleColor(fraction: number, palette: Palette): Rgb {
  const [from, to] = palette.isDark ? DARK_SPAN : LIGHT_SPAN;
  const at = (VIRIDIS.length - 1) * (from + (to - from) * Math.min(1, Math.max(0, fraction)));
  const low = Math.min(VIRIDIS.length - 2, Math.floor(at));
  const [a, b] = [VIRIDIS[low]!, VIRIDIS[low + 1]!];
  return [0, 1, 2].map((k) => Math.round(a[k]! + (b[k]! - a[k]!) * (at - low))) as Rgb;
}

/** What has no value on a scale, or takes no part in it. */
export function grayOf(palette: Palette): Rgb {
  return palette.isDark ? [104, 112, 124] : [178, 184, 192];
}

/**
 * A range of values that only grows while one thing is shown, so that a color keeps its meaning from one picture to the
 * next. Its ends are round.
 */
export class ScaleRange {
  #low = Infinity;
  #high = -Infinity;
  #range: readonly [number, number] = [0, 1];

  reset(): void {
    this.#low = Infinity;
    this.#high = -Infinity;
    this.#range = [0, 1];
  }

  /** Takes values in; those that are not finite are left out. */
  include(values: ArrayLike<number>): void {
    let low = this.#low;
    let high = this.#high;
    for (let i = 0; i < values.length; i++) {
      const value = values[i]!;
      if (!Number.isFinite(value)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
    if (low === this.#low && high === this.#high) return;
    this.#low = low;
    this.#high = high;
    this.#range = roundRange(low, high);
  }

  /** The ends of the scale. */
  get ends(): readonly [number, number] {
    return this.#range;
  }
}

/** A range with round ends around two numbers, from zero where they are of one sign and zero is near. */
export function roundRange(low: number, high: number): [number, number] {
  if (!(low <= high)) return [0, 1];
  const start = low >= 0 && low < 0.5 * high ? 0 : low;
  const end = high <= 0 && high > 0.5 * low ? 0 : high;
  if (start === end) return start === 0 ? [0, 1] : [Math.min(0, start), Math.max(0, end)];
  const step = roundUp((end - start) / 5);
  return [Math.floor(start / step + 1e-9) * step, Math.ceil(end / step - 1e-9) * step];
}
