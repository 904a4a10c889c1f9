/** A watched session loses frames; one out of sight loses nothing. */

import { expect, test } from "vitest";
import { DroppedFrames } from "../../src/state/dropped-frames";

test("what is left out while somebody looks is counted", () => {
  const missed = new DroppedFrames();
  expect([0, 2, 5].map((n) => missed.count(n, true))).toEqual([0, 2, 5]);
});

test("what is left out while nobody looks is not, nor in the first frame afterwards", () => {
  const missed = new DroppedFrames();
  missed.count(0, true);
  missed.count(3, true);
  expect([9, 20].map((n) => missed.count(n, false))).toEqual([3, 3]);
  expect(missed.count(40, true)).toBe(3);
  expect(missed.count(41, true)).toBe(4);
});
