/** The selected body is inspected at once, and then at intervals. */

import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { makeProblem } from "../../src/connection";
import type { BodyId, Inspection, ReplyBody } from "../../src/protocol";
import { Frames } from "../../src/state/frames.svelte";
import { Selection } from "../../src/state/selection.svelte";
import { SessionClient } from "../../src/state/session-client.svelte";
import { FakeHost } from "./host";

const ROBOT: BodyId = { kind: "robot", number: 3, part: null };

function inspectionOf(body: BodyId): ReplyBody {
  return { is: "inspection", body, cycle: 5, title: "robot 3", sections: [], marks: [] } as ReplyBody & Inspection;
}

function openSelection(canInspect = true): { selection: Selection; host: FakeHost; frames: Frames } {
  const host = new FakeHost();
  const client = new SessionClient(host);
  client.id = 1;
  const frames = new Frames(client, { isAfterSeek: () => false, onShown: () => undefined });
  return { selection: new Selection(client, frames, canInspect), host, frames };
}

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

test("a selected body is inspected, and views are notified", async () => {
  const { selection, host, frames } = openSelection();
  let notified = 0;
  frames.subscribe(() => notified++);
  selection.select(ROBOT);
  expect(host.calls("select-scans")).toEqual([{ do: "select-scans", bodies: [ROBOT] }]);
  vi.advanceTimersByTime(0);
  await host.reply("inspect", inspectionOf(ROBOT));
  expect(selection.inspection?.title).toBe("robot 3");
  expect(notified).toBe(1);
});

test("a body is inspected once per interval, however many frames arrive", async () => {
  const { selection, host } = openSelection();
  selection.select(ROBOT);
  vi.advanceTimersByTime(0);
  await host.reply("inspect", inspectionOf(ROBOT));
  for (let i = 0; i < 5; i++) selection.scheduleInspection();
  vi.advanceTimersByTime(150);
  expect(host.calls("inspect")).toEqual([]);
  vi.advanceTimersByTime(100);
  expect(host.calls("inspect").length).toBe(1);
});

test("a reply about the previous selection is ignored, and the new one is inspected", async () => {
  const { selection, host } = openSelection();
  const other: BodyId = { ...ROBOT, number: 4 };
  selection.select(ROBOT);
  vi.advanceTimersByTime(0);
  selection.select(other);
  await host.reply("inspect", inspectionOf(ROBOT));
  expect(selection.inspection).toBeNull();
  vi.advanceTimersByTime(250);
  expect(host.calls("inspect")).toEqual([{ do: "inspect", body: other }]);
});

test("a refused inspection is a problem of the selection", async () => {
  const { selection, host } = openSelection();
  const problem = makeProblem("robot 3", "it has left", "select another one");
  selection.select(ROBOT);
  vi.advanceTimersByTime(0);
  await host.refuse("inspect", problem);
  expect(selection.problem).toEqual(problem);
  expect(host.problems).toEqual([]);
});

test("a fleet's bodies are selected and not inspected", () => {
  const { selection, host } = openSelection(false);
  selection.select(ROBOT);
  vi.advanceTimersByTime(1000);
  expect(selection.body).toEqual(ROBOT);
  expect(host.calls("inspect")).toEqual([]);
});
