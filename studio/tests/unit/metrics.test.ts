/** Samples belong to the cycles at which they were taken, also those of metrics that appear later. */

import { expect, test } from "vitest";
import type { ReplyBody } from "../../src/protocol";
import { Metrics } from "../../src/state/metrics.svelte";

function answered(
  keys: string[],
  first: number,
  cycles: number[],
  values: (number | null)[][],
): () => Promise<ReplyBody> {
  const names = keys.map((key) => ({ key, label: key, unit: "" }));
  return () => Promise.resolve({ is: "metrics", names, first, thinned: 0, cycles, values });
}

test("a metric that appears later has no value before", async () => {
  const metrics = new Metrics();
  await metrics.fetch(answered(["a"], 0, [0, 10], [[1, 2]]));
  await metrics.fetch(answered(["a", "b"], 2, [20], [[3], [9]]));
  expect(metrics.columns).toEqual([
    [1, 2, 3],
    [null, null, 9],
  ]);
});

test("a metric that appears before others does not take their columns", async () => {
  const metrics = new Metrics();
  await metrics.fetch(answered(["b"], 0, [0, 10], [[1, 2]]));
  await metrics.fetch(answered(["a", "b"], 2, [20], [[9], [3]]));
  expect(metrics.columns).toEqual([
    [null, null, 9],
    [1, 2, 3],
  ]);
});

test("a new name without a new sample has a column", async () => {
  const metrics = new Metrics();
  await metrics.fetch(answered(["a"], 0, [0], [[1]]));
  await metrics.fetch(answered(["a", "b"], 1, [], [[], []]));
  expect(metrics.columns).toEqual([[1], [null]]);
  expect(metrics.keysByFirstChange.length).toBe(2);
});
