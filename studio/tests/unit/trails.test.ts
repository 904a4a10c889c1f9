/** Trails cover the displayed positions: in order, bounded, and correct after seeking back. */

import { describe, expect, test, vi } from "vitest";
import { makeProblem, RequestError } from "../../src/connection";
import type { ReplyBody } from "../../src/protocol";
import { Trails } from "../../src/scene/trails";
import type { SessionClient } from "../../src/state/session-client.svelte";
import { TrailSource } from "../../src/state/trail-source";

const at = (...numbers: number[]): Float32Array => Float32Array.from(numbers);

test("positions are appended in order, and a body at rest adds none", () => {
  const trails = new Trails(2, 2);
  trails.push(0, at(0, 0, 9, 9));
  trails.push(1, at(1, 0, 9, 9));
  trails.push(2, at(2, 0, 9, 9));
  expect(trails.points(0)).toEqual([
    [0, 0],
    [1, 0],
    [2, 0],
  ]);
  expect(trails.points(1)).toEqual([[9, 9]]);
});

test("a full ring drops the oldest position", () => {
  const trails = new Trails(1, 3);
  for (let c = 0; c < trails.length + 5; c++) trails.push(c, at(c, 0, 0));
  const way = trails.points(0);
  expect(way.length).toBe(trails.length);
  expect([way[0]![0], way.at(-1)![0]]).toEqual([5, trails.length + 4]);
});

test("seeking back removes later positions, also after the ring has wrapped around", () => {
  const trails = new Trails(1, 2);
  for (let c = 0; c < trails.length + 5; c++) trails.push(c, at(c, 0));
  trails.push(7, at(7, 0));
  expect(trails.points(0)).toEqual([
    [5, 0],
    [6, 0],
    [7, 0],
  ]);
  trails.push(8, at(8, 1));
  expect(trails.points(0).at(-1)).toEqual([8, 1]);
});

test("a jump ahead starts a new trail, as the positions between were not displayed", () => {
  const trails = new Trails(1, 2);
  trails.push(0, at(0, 0));
  trails.push(5000, at(50, 0));
  expect(trails.points(0)).toEqual([[50, 0]]);
});

test("a fast run, whose frames are far apart, has a trail", () => {
  const trails = new Trails(1, 2);
  trails.push(0, at(0, 0));
  for (let k = 1; k <= 6; k++) trails.push(75 * 2 ** k, at(k, 0));
  trails.push(4900, at(7, 0));
  trails.push(7000, at(8, 0));
  expect(trails.points(0).length).toBe(9);
});

test("a seek starts a new trail, also in a fast run", () => {
  const trails = new Trails(1, 2);
  for (let k = 0; k < 5; k++) trails.push(190 * k, at(k, 0));
  trails.push(1400, at(9, 0), true);
  expect(trails.points(0)).toEqual([[9, 0]]);
});

test("many bodies have short trails, which bounds memory", () => {
  expect(new Trails(10_000, 2).length).toBeLessThan(30);
  expect(new Trails(10, 2).length).toBe(600);
});

test("what a seek skipped is asked for once, and then joined with what is displayed since", () => {
  const trails = new Trails(2, 3);
  trails.push(0, at(0, 0, 5, 9, 9, 9));
  expect(trails.hasGap([0])).toBe(false);
  trails.push(5000, at(50, 0, 5, 9, 9, 9), true);
  expect(trails.hasGap([0])).toBe(true);
  trails.push(5001, at(51, 0, 5, 9, 9, 9));
  const body = { kind: "airplane", number: 0, part: null };
  trails.load([{ body, cycles: [0, 2500, 5000], points_m: [0, 0, 5, 25, 0, 5, 50, 0, 5] }], 5000, [0, 1], () => 0);
  expect(trails.hasGap([0])).toBe(false);
  expect(trails.points(0).map(([x]) => x)).toEqual([0, 25, 50, 51]);
  expect(trails.points(1)).toEqual([[9, 9, 9]]);
});

test("a run that is opened later than at its start lacks positions", () => {
  const trails = new Trails(1, 2);
  trails.push(700, at(7, 0));
  expect(trails.hasGap([0])).toBe(true);
  const atStart = new Trails(1, 2);
  atStart.push(0, at(0, 0));
  expect(atStart.hasGap([0])).toBe(false);
});

test("trails outlast a change of who is there: the others keep theirs under their new numbers", () => {
  const before = new Trails(2, 2);
  for (let c = 0; c < 3; c++) before.push(c, at(c, 0, c, 5));
  const after = new Trails(3, 2);
  after.adopt(before, (body) => (body === 0 ? undefined : 2));
  after.push(3, at(8, 8, 9, 9, 3, 5));
  expect(after.points(2)).toEqual([
    [0, 5],
    [1, 5],
    [2, 5],
    [3, 5],
  ]);
  expect(after.points(0)).toEqual([[8, 8]]);
});

test("after a seek back past what the ring holds, positions are asked for", () => {
  const trails = new Trails(1000, 2);
  for (let c = 0; c <= 2000; c++) trails.push(c, new Float32Array(2000).fill(c));
  expect(trails.hasGap([0])).toBe(false);
  const gaps = trails.gapNumber;
  trails.push(500, new Float32Array(2000).fill(500), true);
  expect(trails.hasGap([0])).toBe(true);
  expect(trails.gapNumber).toBeGreaterThan(gaps);
});

test("a seek back within what is known needs no request, and none to the start", () => {
  const trails = new Trails(1, 2);
  for (let c = 0; c <= 400; c++) trails.push(c, at(c, 0));
  trails.push(100, at(100, 0), true);
  expect(trails.hasGap([0])).toBe(false);
  trails.push(5000, at(9, 0), true);
  expect(trails.hasGap([0])).toBe(true);
  trails.push(0, at(0, 0), true);
  expect(trails.hasGap([0])).toBe(false);
});

test("trails of one body do not fill the gap of the others, nor those of an earlier gap that of a later one", () => {
  const trails = new Trails(2, 3);
  trails.push(900, at(9, 0, 0, 5, 0, 0), true);
  trails.push(1900, at(19, 0, 0, 5, 0, 0), true);
  const body = { kind: "robot", number: 0, part: null };
  trails.load([{ body, cycles: [900], points_m: [9, 0, 0] }], 900, [0], () => 0);
  expect(trails.hasGap([0])).toBe(true);
  trails.load([{ body, cycles: [900, 1900], points_m: [9, 0, 0, 19, 0, 0] }], 1900, [0], () => 0);
  expect([trails.hasGap([0]), trails.hasGap([1])]).toEqual([false, true]);
});

describe("requests for trails", () => {
  const one = { kind: "robot", number: 1, part: null };

  function source(answers: Promise<ReplyBody>[]): { source: TrailSource; asked: unknown[] } {
    const asked: unknown[] = [];
    const request = (call: unknown) => {
      asked.push(call);
      return answers.shift()!;
    };
    return { source: new TrailSource({ isLive: true, request } as unknown as SessionClient), asked };
  }

  test("name the bodies that are shown, and a newer one replaces those that wait", async () => {
    vi.useFakeTimers();
    const got: number[] = [];
    const { source: trails, asked } = source([Promise.resolve({ is: "trails", trails: [] })]);
    for (const until of [100, 200]) trails.request({ until, bodies: [one] }, (_, request) => got.push(request.until));
    await vi.advanceTimersByTimeAsync(1000);
    vi.useRealTimers();
    expect(asked).toEqual([{ do: "trails", until: 200, bodies: [one] }]);
    expect(got).toEqual([200]);
  });

  test("are sent at once for a video, which waits for the reply; a refusal does not stop it", async () => {
    const refusal = new RequestError(makeProblem("trails", "too many", "ask for fewer"));
    const { source: trails, asked } = source([Promise.resolve({ is: "trails", trails: [] }), Promise.reject(refusal)]);
    const got: number[] = [];
    for (const until of [100, 200]) {
      trails.request({ until, bodies: [] }, (_, request) => got.push(request.until));
      await trails.settle();
    }
    await trails.settle();
    expect([asked.length, got]).toEqual([2, [100]]);
  });
});
