/** A session goes on after frames that cannot be read. */

import { expect, test, vi } from "vitest";
import type { Method, BodyTable } from "../../src/protocol";
import { encodeFrame } from "../fake/encode";
import { Session } from "../../src/state/session.svelte";

test("frames that cannot be read are granted again, at most once a second", () => {
  vi.useFakeTimers();
  const calls: Method[] = [];
  const ask = (call: Method): Promise<never> => (calls.push(call), new Promise<never>(() => undefined));
  const session = new Session({ kind: "new", world: "robots" }, { request: ask, onProblem: () => undefined });
  session.id = 1;
  session.credit.refill();
  for (let i = 0; i < 2; i++) session.onFrame(new ArrayBuffer(60));
  vi.advanceTimersByTime(900);
  expect(calls.length).toBe(1);
  vi.advanceTimersByTime(5000);
  expect(calls).toEqual([
    { do: "credit", frames: 2, session: 1 },
    { do: "credit", frames: 2, session: 1 },
  ]);
  vi.useRealTimers();
});

test("a session that nobody sees is granted frames slowly, and tells none of them as lost", () => {
  const calls: Method[] = [];
  const ask = (call: Method): Promise<never> => (calls.push(call), new Promise<never>(() => undefined));
  const session = new Session({ kind: "new", world: "robots" }, { request: ask, onProblem: () => undefined });
  session.id = 1;
  const frame = (cycle: number, leftOut: number): void =>
    session.onFrame(
      encodeFrame({
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
      }),
    );
  session.onBodyTable({
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
  } as unknown as BodyTable);
  session.grantHidden();
  frame(1, 0);
  frame(2, 20);
  session.grantHidden();
  expect(calls.filter((call) => call.do === "credit").length).toBe(2);
  expect(session.displayed).toMatchObject({ cycle: 2, leftOut: 0 });
  session.subscribe(() => undefined);
  frame(3, 40);
  session.grantHidden();
  expect(calls.filter((call) => call.do === "credit").length).toBe(2);
  frame(4, 41);
  expect(session.displayed.leftOut).toBe(1);
});
