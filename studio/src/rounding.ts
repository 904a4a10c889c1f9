/** What is an error of rounding, and no difference of values. */

/** Values that differ by less than this share of them are one. */
const ROUNDING = 1e-9;

/** Returns whether values in this range are one, but for errors of rounding. */
export function isConstant(low: number, high: number): boolean {
  return high - low <= ROUNDING * Math.max(Math.abs(low), Math.abs(high));
}
