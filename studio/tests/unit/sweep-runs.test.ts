import { expect, test } from "vitest";
import { listRuns, nextOrder, sortRuns, type Order } from "../../src/state/sweep-runs";
import type { SweepRun } from "../../src/protocol";

const run = (variant: string, seed: number, ...values: (number | null)[]): SweepRun => ({
  variant,
  seed: String(seed),
  failure: "",
  replay: { kind: "scenario", path: "x" },
  values,
});

const marks = (runs: SweepRun[]) => listRuns(runs, [0]).map(({ sides }) => sides[0]);

test("a run far from the others of its variant is marked on its side, and only there", () => {
  // The quartiles are 3 and 7: 13 is 1.5 ranges above, and not beyond.
  const nine = (last: number) => [1, 2, 3, 4, 5, 6, 7, 8, last].map((value, seed) => run("a", seed, value));
  expect(marks(nine(13))).toEqual(Array(9).fill(0));
  expect(marks(nine(13.1))).toEqual([...Array(8).fill(0), 1]);
  expect(marks(nine(-30)).at(-1)).toBe(-1);
  // The same value is usual in another variant.
  const other = [13.1, 13, 13.2, 13.1, 12.9].map((value, seed) => run("b", seed, value));
  expect(marks([...nine(13.1), ...other]).filter((side) => side !== 0)).toEqual([1]);
});

test("few runs, rounding and missing values make no outlier", () => {
  expect(marks([1, 1, 1, 90].map((value, seed) => run("a", seed, value)))).toEqual([0, 0, 0, 0]);
  const third = 1 / 3;
  expect(marks([third, third, third, third, third, third + 1e-16].map((v, seed) => run("a", seed, v)))).toEqual(
    Array(6).fill(0),
  );
  const nearly = [third, third, third, third, third + 1e-16, 5];
  expect(marks(nearly.map((v, seed) => run("a", seed, v)))).toEqual([0, 0, 0, 0, 0, 1]);
  expect(marks([1, 1, 1, 1, null, 9].map((value, seed) => run("a", seed, value)))).toEqual([0, 0, 0, 0, 0, 1]);
});

test("runs are sorted by any column, and those without a value come last either way", () => {
  const listed = listRuns([run("n = 10", 1, 5), run("n = 9", 12, null), run("n = 9", 2, 7)], [0]);
  const seeds = (order: Order) => sortRuns(listed, order).map((one) => one.run.seed);
  expect(seeds({ key: 0, isDescending: true })).toEqual(["2", "1", "12"]);
  expect(seeds({ key: 0, isDescending: false })).toEqual(["1", "2", "12"]);
  expect(seeds({ key: "variant", isDescending: false })).toEqual(["12", "2", "1"]);
  expect(seeds({ key: "seed", isDescending: false })).toEqual(["1", "2", "12"]);
});

test("outliers come first, the most distant one above all", () => {
  const values = [10, 11, 12, 13, 14, 10, 11, 12, 13, 14, 40, 90];
  const listed = listRuns(
    values.map((value, seed) => run("a", seed, value)),
    [0],
  );
  const sorted = sortRuns(listed, { key: "outliers", isDescending: true });
  expect(sorted.map((one) => one.run.values[0]).slice(0, 3)).toEqual([90, 40, 10]);
});

test("a heading turns its order around, and numbers begin with the largest", () => {
  const first = nextOrder({ key: "outliers", isDescending: true }, 2);
  expect(first).toEqual({ key: 2, isDescending: true });
  expect(nextOrder(first, 2)).toEqual({ key: 2, isDescending: false });
  expect(nextOrder(first, "variant")).toEqual({ key: "variant", isDescending: false });
});
