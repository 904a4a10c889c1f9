import { expect, test } from "vitest";
import { nextOrder, sortRuns, sweepRows, type Order } from "../../src/state/sweep-runs";
import type { SweepRun } from "../../src/protocol";

const run = (variant: string, seed: number, ...values: (number | null)[]): SweepRun => ({
  variant,
  seed: String(seed),
  failure: "",
  replay: { kind: "scenario", path: "x" },
  values,
  outliers: [],
});

test("a run is marked in the columns that are shown, on the side of its outlier", () => {
  const outliers = [
    { column: 0, is_high: true, distance_ranges: 3 },
    { column: 2, is_high: false, distance_ranges: null },
  ];
  const runs = [run("a", 1, 1, 2, 3), { ...run("a", 2, 9, 2, -7), outliers }];
  expect(sweepRows(runs, [2, 0, 1]).map(({ sides }) => sides)).toEqual([
    [0, 0, 0],
    [-1, 1, 0],
  ]);
  expect(sweepRows(runs, [0]).map(({ distance }) => distance)).toEqual([0, 3]);
  expect(sweepRows(runs, [2]).map(({ distance }) => distance)).toEqual([0, Infinity]);
  expect(sweepRows(runs, [1]).map(({ distance }) => distance)).toEqual([0, 0]);
});

test("runs are sorted by any column, and those without a value come last either way", () => {
  const listed = sweepRows([run("n = 10", 1, 5), run("n = 9", 12, null), run("n = 9", 2, 7)], [0]);
  const seeds = (order: Order) => sortRuns(listed, order).map((one) => one.run.seed);
  expect(seeds({ key: 0, isDescending: true })).toEqual(["2", "1", "12"]);
  expect(seeds({ key: 0, isDescending: false })).toEqual(["1", "2", "12"]);
  expect(seeds({ key: "variant", isDescending: false })).toEqual(["12", "2", "1"]);
  expect(seeds({ key: "seed", isDescending: false })).toEqual(["1", "2", "12"]);
});

test("outliers come first, the most distant one above all", () => {
  const at = (seed: number, distance_ranges: number | null) => ({
    ...run("a", seed, seed),
    outliers: [{ column: 0, is_high: true, distance_ranges }],
  });
  const rows = sweepRows([run("a", 1, 1), at(2, 4), at(3, 9), at(4, null), run("a", 5, 5)], [0]);
  const sorted = sortRuns(rows, { key: "outliers", isDescending: true });
  expect(sorted.map((one) => one.run.seed)).toEqual(["4", "3", "2", "1", "5"]);
});

test("a heading turns its order around, and numbers begin with the largest", () => {
  const first = nextOrder({ key: "outliers", isDescending: true }, 2);
  expect(first).toEqual({ key: 2, isDescending: true });
  expect(nextOrder(first, 2)).toEqual({ key: 2, isDescending: false });
  expect(nextOrder(first, "variant")).toEqual({ key: "variant", isDescending: false });
});
