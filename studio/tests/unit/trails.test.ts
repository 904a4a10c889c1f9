/** Trails cover the displayed positions: in order, bounded, and correct after seeking back. */

import { expect, test } from "vitest";
import { Trails } from "../../src/scene/trails";

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
  expect(trails.hasGap).toBe(false);
  trails.push(5000, at(50, 0, 5, 9, 9, 9), true);
  expect(trails.hasGap).toBe(true);
  trails.push(5001, at(51, 0, 5, 9, 9, 9));
  const body = { kind: "airplane", number: 0, part: null };
  trails.load([{ body, cycles: [0, 2500, 5000], points_m: [0, 0, 5, 25, 0, 5, 50, 0, 5] }], 5000, () => 0);
  expect(trails.hasGap).toBe(false);
  expect(trails.points(0).map(([x]) => x)).toEqual([0, 25, 50, 51]);
  expect(trails.points(1)).toEqual([[9, 9, 9]]);
});

test("a run that is opened later than at its start lacks positions", () => {
  const trails = new Trails(1, 2);
  trails.push(700, at(7, 0));
  expect(trails.hasGap).toBe(true);
  const atStart = new Trails(1, 2);
  atStart.push(0, at(0, 0));
  expect(atStart.hasGap).toBe(false);
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
