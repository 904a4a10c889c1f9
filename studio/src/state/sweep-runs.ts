/** The runs of a sweep as a table: its order, and the runs that lie far from the others of their variant. */

import type { SweepRun } from "../protocol";

/** A run with its outliers among the columns that are shown. */
export interface SweepRow {
  run: SweepRun;
  /** For each column: 1 if the value is above those of the variant, -1 if it is below, 0 if it is among them. */
  sides: readonly (-1 | 0 | 1)[];
  /** The largest distance of an outlier from the quartiles in interquartile ranges; 0 if it has none. */
  distance: number;
}

/** The rows of some columns, by their places among the values. */
export function sweepRows(runs: readonly SweepRun[], columns: readonly number[]): SweepRow[] {
  return runs.map((run) => {
    const outliers = columns.map((column) => run.outliers.find((outlier) => outlier.column === column));
    return {
      run,
      sides: outliers.map((outlier) => (outlier === undefined ? 0 : outlier.is_high ? 1 : -1)),
      // Where the quartiles are equal, a distance is beyond all measure.
      distance: Math.max(0, ...outliers.map((outlier) => (outlier ? (outlier.distance_ranges ?? Infinity) : 0))),
    };
  });
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
export function sortRuns(runs: readonly SweepRow[], { key, isDescending }: Order): SweepRow[] {
  const sign = isDescending ? -1 : 1;
  const byNumber = (valueOf: (one: SweepRow) => number | null) => (a: SweepRow, b: SweepRow) => {
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
