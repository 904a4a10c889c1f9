/** Values of agents by a metric: asked for when the cycle changes, and not again and again while it stays. */

import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { ReplyBody } from "../../src/protocol";
import { AgentMetrics } from "../../src/state/agent-metrics.svelte";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

/** A recording with a row for each tenth cycle. */
function recordingAt(at: { cycle: number }, asked: number[]) {
  return async (): Promise<ReplyBody> => {
    asked.push(at.cycle);
    return { is: "agent-metrics", names: [], cycle: 10 * Math.floor(at.cycle / 10), values: [1] };
  };
}

test("a recording that rests between two rows is asked once, and again after each move", async () => {
  const at = { cycle: 25 };
  const asked: number[] = [];
  const metrics = new AgentMetrics();
  const ask = recordingAt(at, asked);
  for (const cycle of [25, 25, 25, 30, 30, 25, 25]) {
    at.cycle = cycle;
    await metrics.fetchValues("trips", cycle, ask);
  }
  expect(asked).toEqual([25, 30, 25]);
  expect(metrics.values?.cycle).toBe(20);
  await metrics.fetchValues("contacts", 25, ask);
  expect(asked).toEqual([25, 30, 25, 25]);
});

test("values of a later cycle than the one that is shown are asked for again", async () => {
  const at = { cycle: 50 };
  const asked: number[] = [];
  const metrics = new AgentMetrics();
  const ask = recordingAt(at, asked);
  // The run had been sought to 50 when the request for 40 came.
  await metrics.fetchValues("trips", 40, ask);
  at.cycle = 40;
  await metrics.fetchValues("trips", 40, ask);
  expect([asked, metrics.values?.cycle]).toEqual([[50, 40], 40]);
});
