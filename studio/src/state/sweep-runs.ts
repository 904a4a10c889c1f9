/** The runs of a sweep as a table: its order, and the runs that lie far from the others of their variant. */

import { isConstant } from "../rounding";
import type { SweepRun } from "../protocol";

/** The rule by which a run is an outlier, in words: that of reports and exports. */
export const OUTLIER_RULE =
  "An outlier lies more than 1.5 interquartile ranges outside the quartiles of the runs of its variant (Tukey's rule), in variants of 5 or more runs. Where more than three quarters of the runs agree, every other value is one.";

/** Least number of runs of a variant among which one can be an outlier. */
const MIN_RUNS = 5;
/** Distance from the quartiles in interquartile ranges beyond which a value is an outlier. */
const FENCE_RANGES = 1.5;
/** Relative difference of two values that may come from rounding alone. */
const MAX_ROUNDING = 1e-9;

/** A run with its outliers. */
export interface ListedRun {
  run: SweepRun;
  /** For each column: 1 if the value is above those of the variant, -1 if it is below, 0 if it is among them. */
  sides: readonly (-1 | 0 | 1)[];
  /** The largest distance of an outlier from the quartiles in interquartile ranges; 0 if it has none. */
  distance: number;
}

/** A quantile of sorted values, linear between them. */
function quantile(sorted: readonly number[], share: number): number {
  const at = share * (sorted.length - 1);
  const below = Math.floor(at);
  const above = Math.min(below + 1, sorted.length - 1);
  return sorted[below]! + (at - below) * (sorted[above]! - sorted[below]!);
}

/** The bounds beyond which values of a variant are outliers; null where there are too few, or all agree. */
interface Fences {
  first: number;
  third: number;
}

function fencesOf(values: readonly number[]): Fences | null {
  if (values.length < MIN_RUNS) return null;
  const sorted = [...values].sort((a, b) => a - b);
  if (isConstant(sorted[0]!, sorted.at(-1)!)) return null;
  return { first: quantile(sorted, 0.25), third: quantile(sorted, 0.75) };
}

/** Marks the outliers of some columns, by their places among the values. */
export function listRuns(runs: readonly SweepRun[], columns: readonly number[]): ListedRun[] {
  const fences = new Map<string, (Fences | null)[]>();
  for (const variant of new Set(runs.map((run) => run.variant))) {
    const own = runs.filter((run) => run.variant === variant);
    const valuesOf = (column: number): number[] =>
      own.map((run) => run.values[column] ?? null).filter((v) => v !== null);
    fences.set(
      variant,
      columns.map((column) => fencesOf(valuesOf(column))),
    );
  }
  return runs.map((run) => {
    const own = fences.get(run.variant)!;
    const beyond = columns.map((column, i) => beyondOf(run.values[column] ?? null, own[i] ?? null));
    return {
      run,
      sides: beyond.map(({ side }) => side),
      distance: Math.max(0, ...beyond.map(({ distance }) => distance)),
    };
  });
}

/** The side of an outlier, and its distance in interquartile ranges. */
function beyondOf(value: number | null, fences: Fences | null): { side: -1 | 0 | 1; distance: number } {
  if (value === null || fences === null) return { side: 0, distance: 0 };
  const range = fences.third - fences.first;
  const above = value - fences.third;
  const below = fences.first - value;
  const beyond = Math.max(above, below);
  // Where most runs agree, another one is not special by its rounding alone.
  const rounding = MAX_ROUNDING * Math.max(Math.abs(fences.first), Math.abs(fences.third), Math.abs(value));
  if (beyond <= rounding || beyond <= FENCE_RANGES * range) return { side: 0, distance: 0 };
  return { side: above > 0 ? 1 : -1, distance: beyond / range };
}

/** What runs are sorted by: a column by its place among the values, or one of their own. */
export type SortKey = number | "variant" | "seed" | "outliers";

export interface Order {
  key: SortKey;
  isDescending: boolean;
}

/** The order after a click on a heading: turned around where it is the present one. Numbers begin with the largest. */
export function nextOrder(order: Order, key: SortKey): Order {
  if (order.key === key) return { key, isDescending: !order.isDescending };
  return { key, isDescending: typeof key === "number" || key === "outliers" };
}

/** Sorts runs; those without a value come last either way, and equal ones stay in their order. */
export function sortRuns(runs: readonly ListedRun[], { key, isDescending }: Order): ListedRun[] {
  const sign = isDescending ? -1 : 1;
  const byNumber = (valueOf: (one: ListedRun) => number | null) => (a: ListedRun, b: ListedRun) => {
    const [x, y] = [valueOf(a), valueOf(b)];
    if (x === null || y === null) return (x === null ? 1 : 0) - (y === null ? 1 : 0);
    return x === y ? 0 : sign * (x < y ? -1 : 1);
  };
  const collator = new Intl.Collator("en", { numeric: true });
  if (key === "variant") return [...runs].sort((a, b) => sign * collator.compare(a.run.variant, b.run.variant));
  if (key === "seed") return [...runs].sort((a, b) => sign * collator.compare(a.run.seed, b.run.seed));
  if (key === "outliers") return [...runs].sort(byNumber(({ distance }) => distance));
  return [...runs].sort(byNumber(({ run }) => run.values[key] ?? null));
}
