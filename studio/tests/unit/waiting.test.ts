/** Waiting promises are told when it is so, at once if it is so already, and never hang. */

import { expect, test } from "vitest";
import { Waiting } from "../../src/state/waiting";

test("what is so already is told at once, and what comes later once it is so", async () => {
  const waiting = new Waiting();
  let cycle = 1;
  expect(await waiting.for(() => (cycle === 1 ? "now" : null))).toBe("now");
  const later = waiting.for(() => (cycle === 3 ? cycle : null));
  cycle = 2;
  waiting.changed();
  cycle = 3;
  waiting.changed();
  cycle = 4;
  waiting.over();
  expect(await later).toBe(3);
});

test("what never comes is let go", async () => {
  const waiting = new Waiting();
  const never = waiting.for(() => null);
  waiting.over();
  expect(await never).toBeNull();
});
