/** Waiting promises are told when it is so, at once if it is so already, and never hang. */

import { expect, test } from "vitest";
import { Waiters } from "../../src/state/waiters";

test("what is so already is told at once, and what comes later once it is so", async () => {
  const waiting = new Waiters();
  let cycle = 1;
  expect(await waiting.waitFor(() => (cycle === 1 ? "now" : null))).toBe("now");
  const later = waiting.waitFor(() => (cycle === 3 ? cycle : null));
  cycle = 2;
  waiting.check();
  cycle = 3;
  waiting.check();
  cycle = 4;
  waiting.cancelAll();
  expect(await later).toBe(3);
});

test("what never comes is let go", async () => {
  const waiting = new Waiters();
  const never = waiting.waitFor(() => null);
  waiting.cancelAll();
  expect(await never).toBeNull();
});
