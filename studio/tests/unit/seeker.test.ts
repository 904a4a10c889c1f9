/** Seeks: those that last give way to newer ones, and of quick ones only the latest is kept. */

import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { REPLACED_AFTER_MS, Seeker } from "../../src/state/seeker";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

/** Seeks that end when a test says so. */
function open() {
  const asked: number[] = [];
  const ends = new Map<number, (isReached: boolean) => void>();
  const seeker = new Seeker((cycle) => {
    asked.push(cycle);
    return new Promise((then) => ends.set(cycle, then));
  });
  return { asked, ends, seeker };
}

test("a seek that lasts is replaced by a newer one, whose end counts", async () => {
  const { asked, ends, seeker } = open();
  const first = seeker.seekTo(900_000);
  await vi.advanceTimersByTimeAsync(2 * REPLACED_AFTER_MS);
  const second = seeker.seekTo(10);
  await vi.advanceTimersByTimeAsync(1);
  expect(asked).toEqual([900_000, 10]);
  expect([seeker.isCurrent(900_000), seeker.isCurrent(10)]).toEqual([false, true]);
  ends.get(10)!(true);
  expect([await first, await second]).toEqual([true, true]);
  expect(seeker.target).toBe(null);
});

test("quick seeks are not replaced before they end, so that something is seen while somebody scrubs", async () => {
  const { asked, ends, seeker } = open();
  void seeker.seekTo(1);
  for (let cycle = 2; cycle < 10; cycle++) void seeker.seekTo(cycle);
  await vi.advanceTimersByTimeAsync(REPLACED_AFTER_MS / 2);
  expect(asked).toEqual([1]);
  ends.get(1)!(true);
  await vi.advanceTimersByTimeAsync(1);
  expect(asked).toEqual([1, 9]);
  await vi.advanceTimersByTimeAsync(REPLACED_AFTER_MS * 2);
  expect(asked).toEqual([1, 9]);
});
