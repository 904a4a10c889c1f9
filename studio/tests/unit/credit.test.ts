/** The server may have two frames under way, never more, and never waits for credit that was lost. */

import { expect, test } from "vitest";
import { Credit } from "../../src/credit";

function counted(): { credit: Credit; granted: number[] } {
  const granted: number[] = [];
  return { credit: new Credit((frames) => granted.push(frames)), granted };
}

test("a session begins with two frames, and each drawn one is granted again", () => {
  const { credit, granted } = counted();
  credit.refill();
  for (let i = 0; i < 5; i++) {
    credit.onFrame();
    credit.refill();
  }
  expect(granted).toEqual([2, 1, 1, 1, 1, 1]);
});

test("pictures without a new frame grant nothing", () => {
  const { credit, granted } = counted();
  for (let i = 0; i < 5; i++) credit.refill();
  expect(granted).toEqual([2]);
});

test("two frames that come before one picture are both granted again", () => {
  const { credit, granted } = counted();
  credit.refill();
  credit.onFrame();
  credit.onFrame();
  expect(credit.outstanding).toBe(0);
  credit.refill();
  expect(granted).toEqual([2, 2]);
});

test("a server that starts anew is granted anew", () => {
  const { credit, granted } = counted();
  credit.refill();
  credit.reset();
  credit.refill();
  expect(granted).toEqual([2, 2]);
});
