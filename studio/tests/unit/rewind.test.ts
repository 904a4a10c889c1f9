/** Playing backwards: earlier and earlier cycles, at the speed, one question at a time; and none after the end. */

import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { cyclesBack_per_s, Rewind } from "../../src/state/rewind.svelte";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

test("rewinding follows the clock down to the start, and ends there", async () => {
  const asked: number[] = [];
  const rewind = new Rewind();
  const done = rewind.start(100, 50, (cycle) => (asked.push(cycle), Promise.resolve(true)));
  await vi.advanceTimersByTimeAsync(1000);
  expect(asked.at(-1)).toBeGreaterThanOrEqual(48);
  expect(asked.at(-1)).toBeLessThanOrEqual(52);
  expect(rewind.isOn).toBe(true);
  await vi.advanceTimersByTimeAsync(2000);
  await done;
  expect([asked.at(-1), rewind.isOn]).toEqual([0, false]);
  expect(asked).toEqual([...asked].sort((a, b) => b - a));
  expect(new Set(asked).size).toBe(asked.length);
});

test("a slow server gets one request at a time, and cycles are skipped", async () => {
  const asked: number[] = [];
  let open = 0;
  void new Rewind().start(1000, 100, async (cycle) => {
    expect(++open).toBe(1);
    asked.push(cycle);
    await new Promise((then) => setTimeout(then, 500));
    open--;
    return true;
  });
  await vi.advanceTimersByTimeAsync(5000);
  expect(asked.length).toBeLessThan(12);
  expect(asked.at(-1)).toBeLessThan(600);
});

test("rewinding ends when stopped, or when the server refuses", async () => {
  let asked = 0;
  const rewind = new Rewind();
  void rewind.start(100, 50, () => (asked++, Promise.resolve(true)));
  await vi.advanceTimersByTimeAsync(200);
  rewind.stop();
  const before = asked;
  await vi.advanceTimersByTimeAsync(1000);
  expect([asked, rewind.isOn]).toEqual([before, false]);
  await Promise.all([rewind.start(100, 50, () => Promise.resolve(false)), vi.advanceTimersByTimeAsync(500)]);
  expect(rewind.isOn).toBe(false);
});

test("the fastest speed reaches the start in some seconds, regardless of the run's length", () => {
  expect(cyclesBack_per_s(2, 0.5, 1e6)).toBe(4);
  expect(1e6 / cyclesBack_per_s("fastest", 1, 1e6)).toBeLessThan(20);
  expect(cyclesBack_per_s("fastest", 0.1, 100)).toBe(1000);
});
