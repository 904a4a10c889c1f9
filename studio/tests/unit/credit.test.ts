/** At most two frames are in flight, and lost credit never stops the server. */

import { expect, test } from "vitest";
import { Credit } from "../../src/credit";

function counted(): { credit: Credit; granted: number[] } {
  const granted: number[] = [];
  return { credit: new Credit((frames) => granted.push(frames)), granted };
}

test("a session starts with credit for two frames, which each drawn one refills", () => {
  const { credit, granted } = counted();
  credit.refill();
  for (let i = 0; i < 5; i++) {
    credit.onFrame();
    credit.refill();
  }
  expect(granted).toEqual([2, 1, 1, 1, 1, 1]);
});

test("redrawing the same frame grants nothing", () => {
  const { credit, granted } = counted();
  for (let i = 0; i < 5; i++) credit.refill();
  expect(granted).toEqual([2]);
});

test("two frames that arrive before one drawing are both granted again", () => {
  const { credit, granted } = counted();
  credit.refill();
  credit.onFrame();
  credit.onFrame();
  expect(credit.outstanding).toBe(0);
  credit.refill();
  expect(granted).toEqual([2, 2]);
});

test("a restarted session gets new credit", () => {
  const { credit, granted } = counted();
  credit.refill();
  credit.reset();
  credit.refill();
  expect(granted).toEqual([2, 2]);
});
