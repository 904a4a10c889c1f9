/** Only a watched session counts dropped frames. */

import { expect, test } from "vitest";
import { DroppedFrames } from "../../src/state/dropped-frames";

test("frames dropped while the session is watched count", () => {
  const missed = new DroppedFrames();
  expect([0, 2, 5].map((n) => missed.count(n, true))).toEqual([0, 2, 5]);
});

test("frames dropped while the session is hidden do not count, nor those before the first watched frame", () => {
  const missed = new DroppedFrames();
  missed.count(0, true);
  missed.count(3, true);
  expect([9, 20].map((n) => missed.count(n, false))).toEqual([3, 3]);
  expect(missed.count(40, true)).toBe(3);
  expect(missed.count(41, true)).toBe(4);
});
