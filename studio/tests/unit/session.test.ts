/** A session goes on after frames that cannot be read. */

import { expect, test, vi } from "vitest";
import type { Call } from "../../src/protocol";
import { Session } from "../../src/state/session.svelte";

test("frames that cannot be read are granted again, at most once a second", () => {
  vi.useFakeTimers();
  const calls: Call[] = [];
  const ask = (call: Call): Promise<never> => (calls.push(call), new Promise<never>(() => undefined));
  const session = new Session({ kind: "new", world: "robots" }, { ask, problem: () => undefined });
  session.id = 1;
  session.credit.drawn();
  for (let i = 0; i < 2; i++) session.takeFrame(new ArrayBuffer(60));
  vi.advanceTimersByTime(900);
  expect(calls.length).toBe(1);
  vi.advanceTimersByTime(5000);
  expect(calls).toEqual([{ do: "credit", frames: 2, session: 1 }, { do: "credit", frames: 2, session: 1 }]);
  vi.useRealTimers();
});
