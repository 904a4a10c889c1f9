/** A search over all events of a session, page by page, and a list that tells what it leaves out. */

import { expect, test, vi } from "vitest";
import type { ReplyBody, RunEvent } from "../../src/protocol";
import { RequestError, makeProblem } from "../../src/connection";
import { EventSearch, EVENTS_PER_PAGE } from "../../src/state/event-search.svelte";
import { Events } from "../../src/state/events.svelte";

function happened(cycle: number): RunEvent {
  const none = { body: null, other: null, at_m: null, value: null, unit: "" };
  return { cycle, level: "info", kind: "contact", text: `at ${cycle}`, ...none };
}

/** A server that has so many events, all of which match. */
function serverOf(total: number, asked: unknown[]) {
  return async (text: string, kinds: string[] | null, skip: number, limit: number): Promise<ReplyBody> => {
    asked.push([text, kinds, skip, limit]);
    const entries = Array.from({ length: Math.max(0, Math.min(limit, total - skip)) }, (_, i) => happened(skip + i));
    return { is: "found-events", entries, found: total, searched: total, left_out: 0, kinds: [["contact", total]] };
  };
}

test("a search begins once typing pauses, and more is added page by page", async () => {
  vi.useFakeTimers();
  const asked: unknown[] = [];
  const ask = serverOf(1200, asked);
  const search = new EventSearch();
  search.type("wa", null, ask);
  search.type("wall", ["contact"], ask);
  await vi.runAllTimersAsync();
  expect(asked).toEqual([["wall", ["contact"], 0, EVENTS_PER_PAGE]]);
  expect([search.entries.length, search.found?.found]).toEqual([500, 1200]);
  await search.more(ask);
  await search.more(ask);
  await search.more(ask);
  expect(search.entries.map(({ cycle }) => cycle)).toEqual(Array.from({ length: 1200 }, (_, i) => i));
  expect(asked.length).toBe(3);
  vi.useRealTimers();
});

test("what has happened since is found too, without losing the pages that are shown", async () => {
  vi.useFakeTimers();
  const asked: unknown[] = [];
  const search = new EventSearch();
  search.type("wall", null, serverOf(900, asked));
  await vi.runAllTimersAsync();
  await search.more(serverOf(900, asked));
  await search.refresh(950, serverOf(950, asked));
  expect([search.entries.length, search.found?.found]).toEqual([900, 950]);
  await search.refresh(950, serverOf(950, asked));
  expect(asked.length).toBe(3);
  search.type("", null, serverOf(950, asked));
  expect([search.isActive, search.entries.length]).toEqual([false, 0]);
  vi.useRealTimers();
});

test("a search is asked again after a restart, and after a request that failed, whose problem is told", async () => {
  vi.useFakeTimers();
  const asked: unknown[] = [];
  const search = new EventSearch();
  search.type("wall", null, serverOf(3, asked));
  await search.refresh(3, serverOf(3, asked));
  expect(asked, "typing may go on").toEqual([]);
  await vi.runAllTimersAsync();
  await search.refresh(3, serverOf(3, asked));
  expect(asked.length, "the first reply had all events").toBe(1);
  search.clear();
  expect([search.isActive, search.found]).toEqual([true, null]);
  const problem = makeProblem("events", "the connection was lost", "wait");
  await search.refresh(0, () => Promise.reject(new RequestError(problem)));
  expect([search.found, search.problem]).toEqual([null, problem]);
  await search.refresh(0, serverOf(0, asked));
  expect([search.found?.found, search.problem]).toEqual([0, null]);
  vi.useRealTimers();
});

test("a page that cannot be added leaves those that are shown, with the problem", async () => {
  vi.useFakeTimers();
  const search = new EventSearch();
  search.type("wall", null, serverOf(900, []));
  await vi.runAllTimersAsync();
  const problem = makeProblem("events", "the connection was lost", "wait");
  await search.more(() => Promise.reject(new RequestError(problem)));
  expect([search.entries.length, search.problem]).toEqual([500, problem]);
  vi.useRealTimers();
});

test("a run that goes on is searched one request at a time, for a tenth of the time", async () => {
  vi.useFakeTimers();
  const asked: unknown[] = [];
  const search = new EventSearch();
  const slow = async (...all: Parameters<ReturnType<typeof serverOf>>): Promise<ReplyBody> => {
    await new Promise((then) => setTimeout(then, 500));
    return serverOf(100 + asked.length, asked)(...all);
  };
  search.type("wall", null, slow);
  for (let k = 0; k < 50; k++) {
    void search.refresh(200 + k, slow);
    await vi.advanceTimersByTimeAsync(400);
  }
  // 20 s hold a search of half a second each 5.5 s.
  expect(asked.length).toBeGreaterThanOrEqual(3);
  expect(asked.length).toBeLessThanOrEqual(5);
  expect(search.found?.found).toBe(100 + asked.length - 1);
  vi.useRealTimers();
});

test("the list keeps the newest events and tells the number of all", async () => {
  const all = Array.from({ length: 30_000 }, (_, cycle) => happened(cycle));
  const events = new Events();
  await events.fetch(30_000, async (from, until, skip, limit) => {
    const wanted = all.filter(({ cycle }) => cycle >= from && cycle < until).slice(skip);
    const entries = wanted.slice(0, limit);
    return { is: "events", entries, left_out: wanted.length - entries.length + 5, known_until: until };
  });
  expect([events.list.length, events.list[0]?.cycle]).toEqual([20_000, 10_000]);
  expect(events.total).toBe(30_005);
});
