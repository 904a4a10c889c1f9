/** Values belong to the cycles of their rows; charts show first what the world is about. */

import { expect, test } from "vitest";
import type { MetricRow, ReplyBody } from "../../src/protocol";
import { AgentMetrics } from "../../src/state/agent-metrics.svelte";
import { Metrics } from "../../src/state/metrics.svelte";

interface Rows {
  first?: number;
  cycles: number[];
  values: (number | null)[][];
  present?: MetricRow;
}

/** A server with metrics `a`, `b`, ... of which some are those that the world is about. */
function answered(
  { first = 0, cycles, values, present }: Rows,
  primary: readonly string[] = [],
): () => Promise<ReplyBody> {
  const keys = values.map((_, i) => "abcdef"[i]!);
  const names = keys.map((key) => ({ key, label: key, unit: "", is_primary: primary.includes(key) }));
  return () => Promise.resolve({ is: "metrics", names, first, cycles, values, present: present ?? null });
}

test("rows are appended, and told once", async () => {
  const metrics = new Metrics();
  await metrics.fetch(answered({ cycles: [0, 10], values: [[1, 2]] }));
  await metrics.fetch(answered({ first: 2, cycles: [20], values: [[null]] }));
  await metrics.fetch(answered({ first: 3, cycles: [], values: [[]] }));
  expect([metrics.cycles, metrics.columns]).toEqual([[0, 10, 20], [[1, 2, null]]]);
});

test("the present cycle has its place among the rows, and a row of its own is not doubled", async () => {
  const metrics = new Metrics();
  const at = (cycle: number, value: number): MetricRow => ({ cycle, values: [value] });
  await metrics.fetch(answered({ cycles: [0, 10, 20], values: [[1, 2, 3]], present: at(14, 7) }));
  expect(metrics.curve("a")).toEqual({ cycles: [0, 10, 14, 20], values: [1, 2, 7, 3] });
  await metrics.fetch(answered({ first: 3, cycles: [], values: [[]], present: at(10, 2) }));
  expect(metrics.curve("a").cycles).toEqual([0, 10, 20]);
  await metrics.fetch(answered({ first: 3, cycles: [], values: [[]], present: at(25, 9) }));
  expect(metrics.curve("a").values).toEqual([1, 2, 3, 9]);
});

test("a value between two rows is that of the earlier one, with its cycle", async () => {
  const metrics = new Metrics();
  await metrics.fetch(answered({ cycles: [0, 10], values: [[1, null]] }));
  expect(metrics.valueAt("a", 9)).toEqual({ cycle: 0, value: 1 });
  expect(metrics.valueAt("a", 4000)).toEqual({ cycle: 10, value: null });
  expect(new Metrics().valueAt("a", 9)).toBeNull();
});

test("charts show what the world is about and has changed, in its order", async () => {
  const metrics = new Metrics();
  const primary = ["a", "b", "c"];
  await metrics.fetch(answered({ cycles: [0], values: [[0], [0], [0], [5]] }, primary));
  expect(metrics.defaultKeys(2)).toEqual(["a", "b"]);
  await metrics.fetch(answered({ first: 1, cycles: [10], values: [[0], [0], [4], [6]] }, primary));
  expect(metrics.defaultKeys(2)).toEqual(["a", "c"]);
  await metrics.fetch(answered({ first: 2, cycles: [20], values: [[1], [1], [4], [7]] }, primary));
  expect(metrics.defaultKeys(2)).toEqual(["a", "b"]);
});

test("an error of rounding is no change, and the first value is none either", async () => {
  const metrics = new Metrics();
  const values = [
    [0, 0, 0],
    [null, 0.02, 0.02 + 1e-17],
    [0.5, 0.5000000000000219, 0.5],
    [null, 3, 2],
  ];
  await metrics.fetch(answered({ cycles: [0, 1, 2], values }, ["a", "b", "c", "d"]));
  expect(metrics.defaultKeys(2)).toEqual(["a", "d"]);
});

test("a world that names no metrics shows its first ones", async () => {
  const metrics = new Metrics();
  await metrics.fetch(
    answered({
      cycles: [0, 10],
      values: [
        [0, 0],
        [0, 1],
        [2, 2],
      ],
    }),
  );
  expect(metrics.defaultKeys(2)).toEqual(["a", "b"]);
});

test("values of agents are asked for once in each cycle, though a replay answers with those of an earlier one", async () => {
  const metrics = new AgentMetrics();
  let asked = 0;
  const ask = (): Promise<ReplyBody> => {
    asked++;
    return Promise.resolve({ is: "agent-metrics", names: [], cycle: 10, values: [1] });
  };
  await metrics.fetchValues("trips", 15, ask);
  await metrics.fetchValues("trips", 15, ask);
  expect([asked, metrics.values?.cycle]).toEqual([1, 10]);
  // For a picture that is kept, a new cycle is asked for at once.
  await metrics.completeValues("trips", 16, ask);
  await metrics.completeValues("trips", 16, ask);
  expect(asked).toBe(2);
});
