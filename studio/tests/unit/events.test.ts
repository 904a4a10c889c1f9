/** All events are fetched, in several requests if necessary, and missing ones are counted once. */

import { afterEach, expect, test, vi } from "vitest";
import type { ReplyBody, RunEvent } from "../../src/protocol";
import { Events } from "../../src/state/events.svelte";

function event(cycle: number, number: number): RunEvent {
  return {
    cycle,
    level: "info",
    kind: "contact",
    body: { kind: "robot", number, part: null },
    other: null,
    at_m: null,
    value: null,
    text: "",
  } as RunEvent;
}

/** The server's replies, of at most 5000 events each. */
function server(
  all: RunEvent[],
  lost = 0,
): (from: number, until: number, skip: number, most: number) => Promise<ReplyBody> {
  return (from, until, skip, most) => {
    const there = all.filter(({ cycle }) => cycle >= from && cycle < until).slice(skip);
    const entries = there.slice(0, Math.min(most, 5000));
    return Promise.resolve({
      is: "events",
      entries,
      left_out: there.length - entries.length + lost,
      known_until: until,
    });
  };
}

test("events that do not fit into one reply are fetched by further requests", async () => {
  const events = new Events();
  await events.fetch(5000, server(Array.from({ length: 5000 }, (_, i) => event(i, 1))));
  expect([events.list.length, events.leftOut]).toEqual([5000, 0]);
});

test("a cycle with more events than the request's limit is fetched completely", async () => {
  const events = new Events();
  await events.fetch(10, server(Array.from({ length: 4500 }, (_, i) => event(3, i))));
  expect([events.list.length, events.leftOut]).toEqual([4500, 0]);
});

test("a cycle with more events than the server's limit is fetched completely, and so are later ones", async () => {
  const events = new Events();
  const all = [
    event(2, 1),
    ...Array.from({ length: 6000 }, (_, i) => event(3, i % 100)),
    ...Array.from({ length: 5000 }, (_, i) => event(4 + i, 1)),
  ];
  await events.fetch(9000, server(all));
  expect([events.list.length, events.leftOut]).toEqual([all.length, 0]);
});

test("events that the server never kept are counted once", async () => {
  const events = new Events();
  await events.fetch(10, server([event(3, 1)], 7));
  await events.fetch(20, server([event(9, 1), event(12, 1)]));
  expect([events.list.length, events.leftOut]).toEqual([2, 7]);
});

test("two equal events of one cycle stay two, however often they are fetched", async () => {
  const events = new Events();
  events.add([event(3, 1), event(3, 1), event(4, 1)]);
  expect(events.list.length).toBe(3);
  events.add([event(3, 1), event(3, 1)]);
  await events.fetch(10, server([event(3, 1), event(3, 1), event(4, 1)]));
  expect([events.list.length, events.kinds.get("contact")]).toEqual([3, 3]);
});

test("events of hidden kinds are neither visible nor neighbors", () => {
  const events = new Events();
  events.add([event(3, 1), { ...event(5, 1), kind: "turn" }, event(7, 1)]);
  events.toggleKind("turn");
  expect(events.visible.map(({ cycle }) => cycle)).toEqual([3, 7]);
  expect([events.neighbor(3, 1)?.cycle, events.neighbor(7, -1)?.cycle]).toEqual([7, 3]);
  events.toggleKind("turn");
  expect(events.neighbor(3, 1)?.cycle).toBe(5);
});

afterEach(() => vi.useRealTimers());

test("events of frames come at once after a pause, and together while frames follow each other", () => {
  vi.useFakeTimers();
  const events = new Events();
  events.addOfFrame([event(1, 0)]);
  expect(events.list.length).toBe(1);
  for (let cycle = 2; cycle <= 6; cycle++) events.addOfFrame([event(cycle, 0)]);
  expect(events.list.length).toBe(1);
  vi.advanceTimersByTime(1000);
  expect(events.list.map(({ cycle }) => cycle)).toEqual([1, 2, 3, 4, 5, 6]);
  events.addOfFrame([event(7, 0)]);
  expect(events.list.length).toBe(7);
  events.addOfFrame([event(8, 0)]);
  events.clear();
  vi.advanceTimersByTime(1000);
  expect(events.list).toEqual([]);
});
