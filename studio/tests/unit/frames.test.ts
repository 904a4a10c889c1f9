/** Frames of a session: order, credit, and frames that cannot be shown. */

import { expect, test, vi } from "vitest";
import type { BodyTable } from "../../src/protocol";
import { Frames } from "../../src/state/frames.svelte";
import { SessionClient } from "../../src/state/session-client.svelte";
import { encodeFrame } from "../fake/encode";
import { FakeHost } from "./host";

const EMPTY_TABLE = {
  session: 1,
  id: 1,
  kinds: [],
  kind: [],
  number: [],
  part: [],
  is_agent: [],
  names: [],
  shapes: [],
  shape: [],
  appearances: [],
  appearance: [],
} as unknown as BodyTable;

function emptyFrame(cycle: number, leftOut: number): ArrayBuffer {
  return encodeFrame({
    session: 1,
    tableId: 1,
    dimensions: 2,
    cycle,
    time_s: 0,
    positions_m: [],
    orientations: [],
    lines: [],
    conditions: [],
    leftOut,
  });
}

function openFrames(): { frames: Frames; host: FakeHost; shown: number[] } {
  const host = new FakeHost();
  const client = new SessionClient(host);
  client.id = 1;
  const shown: number[] = [];
  const frames = new Frames(client, { isAfterSeek: () => true, onShown: ({ cycle }) => shown.push(cycle) });
  return { frames, host, shown };
}

test("credit for frames that cannot be read is granted again, at most once a second", () => {
  vi.useFakeTimers();
  const { frames, host } = openFrames();
  frames.credit.refill();
  for (let i = 0; i < 2; i++) frames.onFrame(new ArrayBuffer(60));
  vi.advanceTimersByTime(900);
  expect(host.calls("credit").length).toBe(1);
  vi.advanceTimersByTime(5000);
  expect(host.calls("credit")).toEqual([
    { do: "credit", frames: 2 },
    { do: "credit", frames: 2 },
  ]);
  expect(host.problems.length).toBe(2);
  vi.useRealTimers();
});

test("a hidden session is granted few frames, and does not count skipped ones as dropped", () => {
  const { frames, host } = openFrames();
  frames.onBodyTable(EMPTY_TABLE, { groups: [], names: [] });
  frames.grantHidden();
  frames.onFrame(emptyFrame(1, 0));
  frames.onFrame(emptyFrame(2, 20));
  frames.grantHidden();
  expect(host.calls("credit").length).toBe(2);
  expect(frames.displayed).toMatchObject({ cycle: 2, leftOut: 0 });
  frames.subscribe(() => undefined);
  frames.onFrame(emptyFrame(3, 40));
  frames.grantHidden();
  expect(host.calls("credit").length).toBe(2);
  frames.onFrame(emptyFrame(4, 41));
  expect(frames.displayed.leftOut).toBe(1);
});

test("a frame that arrives before its body table is shown once the table is there", () => {
  const { frames, shown } = openFrames();
  let notified = 0;
  frames.subscribe(() => notified++);
  frames.onFrame(emptyFrame(5, 0));
  expect([shown, notified]).toEqual([[], 0]);
  frames.onBodyTable(EMPTY_TABLE, { groups: [], names: [] });
  expect([shown, notified, frames.newest?.cycle, frames.isAfterSeek]).toEqual([[5], 1, 5, true]);
});

test("waiting for a cycle ends with its frame, or with the wait's end", async () => {
  const { frames } = openFrames();
  frames.onBodyTable(EMPTY_TABLE, { groups: [], names: [] });
  const frame = frames.waitForCycle(6);
  frames.onFrame(emptyFrame(5, 0));
  frames.onFrame(emptyFrame(6, 0));
  expect((await frame)?.cycle).toBe(6);
  const canceled = frames.waitForCycle(7);
  frames.cancelWaits();
  expect(await canceled).toBeNull();
});
