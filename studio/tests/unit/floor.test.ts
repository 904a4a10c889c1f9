/** Runs of equal boxes become boxes, row by row. */

import { expect, test } from "vitest";
import { boxesOf } from "../../src/scene/floor";

test("runs continue over the ends of rows", () => {
  expect([...boxesOf({ width: 3, height: 2, runs: [1, 2, 0, 3, 2, 1] })]).toEqual([1, 1, 0, 0, 0, 2]);
});

test("boxes without a run are unknown, and runs end at the floor's end", () => {
  expect([...boxesOf({ width: 2, height: 2, runs: [0, 1] })]).toEqual([0, 2, 2, 2]);
  expect([...boxesOf({ width: 2, height: 2, runs: [1, 1_000_000, 0, 5] })]).toEqual([1, 1, 1, 1]);
  expect([...boxesOf({ width: 2, height: 1, runs: [0] })]).toEqual([2, 2]);
});
