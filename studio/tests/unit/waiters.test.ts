/** Waits resolve once their condition holds, or when they are canceled. */

import { expect, test } from "vitest";
import { Waiters } from "../../src/state/waiters";

test("a condition that holds resolves at once, any other one when it holds after a change", async () => {
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

test("canceled waits resolve with null", async () => {
  const waiting = new Waiters();
  const never = waiting.waitFor(() => null);
  waiting.cancelAll();
  expect(await never).toBeNull();
});
