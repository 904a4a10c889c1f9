/** The run of a session as the server describes it. */

import { expect, test } from "vitest";
import type { Scene, SessionStatus } from "../../src/protocol";
import { RunState } from "../../src/state/run-state.svelte";

function runWith(status: Partial<SessionStatus>): RunState {
  const run = new RunState();
  const full = { state: "paused", cycle: 0, cycles_planned: null, seed: "7", ...status } as SessionStatus;
  run.onStart({ name: "Hall" } as Scene, full);
  return run;
}

test("the timeline ends at the planned cycle, or grows with the run", () => {
  expect(runWith({ cycles_planned: 40, cycle: 3 }).lastCycle).toBe(40);
  expect(runWith({ cycle: 3 }).lastCycle).toBe(100);
  expect(runWith({ cycle: 345 }).lastCycle).toBe(345);
});

test("a seed that no JavaScript number holds is none", () => {
  expect(runWith({ seed: "7" }).seed).toBe(7);
  expect(runWith({ seed: "18446744073709551615" }).seed).toBeNull();
  expect(runWith({ seed: "" }).seed).toBeNull();
});

test("each start is counted, and a run that has ended does not play", () => {
  const run = runWith({ state: "playing" });
  expect([run.isPlaying, run.starts]).toEqual([true, 1]);
  run.onStart(run.scene, run.status);
  run.onEnded();
  expect([run.isPlaying, run.status.state, run.starts]).toEqual([false, "failed", 2]);
});
