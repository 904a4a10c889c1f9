/** Colors of bodies: what they stand for, and that they can be told apart. */

import { expect, test } from "vitest";
import type { Frame } from "../../src/decode";
import type { BodyTable } from "../../src/protocol";
import { Coloring } from "../../src/scene/coloring";
import { legendLines } from "../../src/scene/color-legend";
import { cellsOf, countIn, doSymbolsCrowd, isCrowd } from "../../src/scene/density";
import { PlaneCamera } from "../../src/scene/camera";
import { Motion } from "../../src/scene/motion";
import { packColor, paletteOf, type Rgb } from "../../src/scene/palette";
import { grayOf, roundRange, scaleColor, ScaleRange } from "../../src/scene/scale";
import { findAgents, rowsOf } from "../../src/state/agent-rows";
import { Bodies } from "../../src/state/bodies";

const LOOKS = Array.from({ length: 5 }, () => ({ color: [10, 20, 30] as Rgb, opacity: 1, layer: 1 }));

/** Four robots, of which two are couriers, and a person. */
function bodies(): Bodies {
  const table = {
    kinds: ["robot", "person"],
    kind: [0, 0, 0, 0, 1],
    number: [0, 1, 2, 3, 4],
    part: [-1, -1, -1, -1, -1],
    shapes: [{ type: "sphere", radius_m: 1 }],
    shape: [0, 0, 0, 0, 0],
    appearances: [LOOKS],
    appearance: [0, 0, 0, 0, 0],
    names: [[3, "Anna"]],
    is_agent: [true, true, true, true, false],
  } as unknown as BodyTable;
  return new Bodies(table, [
    { name: "couriers", kind: "robot", first: 0, count: 2 },
    { name: "guards", kind: "robot", first: 2, count: 2 },
  ]);
}

function frame(cycle: number, positions_m: number[], conditions: number[] = [0, 0, 0, 0, 0], dimensions = 2): Frame {
  return {
    cycle,
    dimensions,
    positions_m: Float32Array.from(positions_m),
    conditions: Uint8Array.from(conditions),
  } as unknown as Frame;
}

const light = paletteOf(false);

/** Relative luminance, by which a reader who sees no colors tells them apart. */
function luminance(color: Rgb): number {
  const [r, g, b] = color.map((part) => (part / 255) ** 2.2) as [number, number, number];
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

test("a scale goes one way in lightness, from what is near the floor to what stands out", () => {
  for (const isDark of [false, true]) {
    const steps = Array.from({ length: 21 }, (_, i) => luminance(scaleColor(i / 20, paletteOf(isDark))));
    for (let i = 1; i < steps.length; i++) {
      if (isDark) expect(steps[i]).toBeGreaterThan(steps[i - 1]!);
      else expect(steps[i]).toBeLessThan(steps[i - 1]!);
    }
  }
  expect(scaleColor(-1, light)).toEqual(scaleColor(0, light));
  expect(scaleColor(2, light)).toEqual(scaleColor(1, light));
});

test("the ends of a scale are round, and only move outward", () => {
  expect([roundRange(0.3, 7.2), roundRange(99, 101), roundRange(-3, 4), roundRange(0, 0)]).toEqual([
    [0, 8],
    [99, 101],
    [-4, 4],
    [0, 1],
  ]);
  const range = new ScaleRange();
  range.include([1, NaN, 7]);
  expect(range.ends).toEqual([0, 8]);
  range.include([3, 4]);
  expect(range.ends).toEqual([0, 8]);
  range.reset();
  range.include([3, 4]);
  expect(range.ends).toEqual([3, 4]);
});

test("groups have colors of their own, others are gray, and the legend counts them", () => {
  const coloring = new Coloring(bodies(), 2, 1);
  coloring.setMode("group");
  coloring.update(frame(0, []), null, light);
  const [a, b, c, d, person] = coloring.tints!;
  expect(a).toBe(b);
  expect(c).toBe(d);
  expect(a).not.toBe(c);
  expect(person).toBe(packColor(grayOf(light), 1));
  expect(coloring.legend).toMatchObject({
    kind: "categories",
    entries: [
      { name: "couriers", count: 2 },
      { name: "guards", count: 2 },
    ],
  });
});

test("states are told apart, and only those that occur are listed", () => {
  const coloring = new Coloring(bodies(), 2, 1);
  coloring.setMode("state");
  coloring.update(frame(0, [], [0, 3, 0, 4, 0]), null, light);
  expect(new Set([...coloring.tints!].slice(0, 4)).size).toBe(3);
  expect(coloring.legend).toMatchObject({
    entries: [
      { name: "no contact", count: 2 },
      { name: "touches, or too close", count: 1 },
      { name: "failed", count: 1 },
    ],
  });
});

test("a metric colors each agent by its number, and those without a value are gray", () => {
  const coloring = new Coloring(bodies(), 2, 1);
  coloring.setMode("metric:trips");
  const values = { key: "trips", label: "trips completed", unit: "", cycle: 7, values: [0, 10, null, 5] };
  coloring.update(frame(9, []), values, light);
  expect([...coloring.tints!].slice(0, 3)).toEqual([
    packColor(scaleColor(0, light), 1),
    packColor(scaleColor(1, light), 1),
    packColor(grayOf(light), 1),
  ]);
  expect(coloring.legend).toEqual({
    kind: "scale",
    title: "trips completed",
    unit: "",
    ends: [0, 10],
    note: "at cycle 7",
    hasNone: true,
  });
});

test("speeds are means over the last cycles, and waiting counts from the last move", () => {
  const motion = new Motion(2, 2);
  for (let cycle = 0; cycle <= 30; cycle++) motion.push(cycle, Float32Array.from([0.5 * cycle, 0, 4, 4]), false);
  const [moving, resting] = motion.speeds(0.5);
  expect(moving).toBeCloseTo(1, 6);
  expect(resting).toBe(0);
  expect([...motion.waiting()]).toEqual([0, 30]);
  for (let cycle = 31; cycle <= 40; cycle++) motion.push(cycle, Float32Array.from([15, 0, 4, 4]), false);
  expect(motion.speeds(0.5)[0]).toBeCloseTo(0.5, 6);
  expect([...motion.waiting()]).toEqual([10, 40]);
});

test("after a seek nothing is known of motions before it", () => {
  const motion = new Motion(1, 2);
  for (let cycle = 0; cycle <= 5; cycle++) motion.push(cycle, Float32Array.from([cycle, 0]), false);
  motion.push(300, Float32Array.from([9, 9]), true);
  expect(motion.since).toBe(300);
  expect(Number.isNaN(motion.speeds(1)[0])).toBe(true);
  expect([...motion.waiting()]).toEqual([0]);
  motion.push(301, Float32Array.from([9, 11]), false);
  expect(motion.speeds(1)[0]).toBe(2);
});

test("agents are counted in the cells where they are, and values summed up", () => {
  const camera = new PlaneCamera();
  camera.resize(200, 100);
  camera.mPerPx = 0.1;
  camera.center([10, 5, 0]);
  const cells = cellsOf(camera, [200, 100]);
  expect(cells).toMatchObject({ side_m: 1, x: 0, y: 0, columns: 20, rows: 10 });
  const at = frame(0, [0.5, 0.5, 0.9, 0.1, 19.5, 9.5, -5, 2, 3, 3]);
  const { counts, sums } = countIn(cells, at, bodies().agents, Float32Array.from([1, 3, 7, 9, 9]));
  expect([counts[0], sums[0], counts[199], sums[199]]).toEqual([2, 4, 1, 7]);
  expect(counts.reduce((sum, count) => sum + count, 0)).toBe(3);
});

test("agents in space are counted where they are seen from above", () => {
  const camera = new PlaneCamera();
  camera.resize(200, 100);
  camera.mPerPx = 0.1;
  camera.center([10, 5, 0]);
  const at = frame(0, [0.5, 0.5, 900, 0.9, 0.1, 800, 19.5, 9.5, 7, -5, 2, 6], [0, 0, 0, 0], 3);
  const { counts } = countIn(cellsOf(camera, [200, 100]), at, bodies().agents, null);
  expect([counts[0], counts[199]]).toEqual([2, 1]);
});

test("symbols crowd where they would cover the view, not because bodies are small there", () => {
  const camera = new PlaneCamera();
  camera.resize(1000, 500);
  camera.center([0, 0, 0]);
  const agents = Uint32Array.from({ length: 4000 }, (_, i) => i);
  const at = frame(0, [...agents].flatMap((i) => [i % 80, Math.floor(i / 80), 9000]), [], 3); // prettier-ignore
  const crowds = (mPerPx: number, symbol_px: number): boolean => {
    camera.mPerPx = mPerPx;
    camera.resize(1000, 500);
    return doSymbolsCrowd(at, agents, camera, [1000, 500], symbol_px);
  };
  expect([crowds(1, 13), crowds(1, 4), crowds(0.02, 13)]).toEqual([true, false, false]);
  expect(doSymbolsCrowd(at, agents.subarray(0, 1000), camera, [1000, 500], 40)).toBe(false);
});

test("in a video, which seeks from frame to frame, speeds are known", () => {
  const motion = new Motion(1, 2);
  for (let cycle = 0; cycle <= 60; cycle += 15) motion.push(cycle, Float32Array.from([2 * cycle, 0]), true);
  expect(motion.speeds(1)[0]).toBeCloseTo(2, 6);
  expect(motion.window).toBe(30);
  for (let cycle = 160; cycle <= 360; cycle += 100) motion.push(cycle, Float32Array.from([2 * cycle, 0]), true);
  expect(motion.speeds(1)[0]).toBeCloseTo(2, 6);
  expect(motion.window).toBe(100);
});

test("the speed of traffic is that of its velocities, over the ground and at once", () => {
  const coloring = new Coloring(bodies(), 3, 1);
  coloring.setMode("speed");
  const velocities_m_s = Float32Array.from([3, 4, 12, 0, 0, 5, 0, 8, 0, 0, 0, 0, 0, 0, 0]);
  coloring.update({ ...frame(0, [], [0, 0, 0, 0, 0], 3), velocities_m_s }, null, light);
  expect([...coloring.values!]).toEqual([5, 0, 8, 0, 0]);
  expect(coloring.legend).toMatchObject({ kind: "scale", title: "Ground speed", note: "" });
});

test("the legend of an image lists what that of the page does", () => {
  const entries = Array.from({ length: 10 }, (_, i) => ({ name: `g${i}`, color: [i, 0, 0] as Rgb, count: i }));
  const words = legendLines({ kind: "categories", title: "Group", entries }, light).map((line) => line.words);
  expect(words).toEqual([
    "Group",
    ...entries.slice(0, 8).map(({ name }) => name),
    "and 2 more, in the same colors again",
  ]);
  const scale = { kind: "scale", title: "Speed", unit: "m/s", ends: [0, 4], note: "mean", hasNone: true } as const;
  const lines = legendLines(scale, light);
  expect(lines.map((line) => line.words)).toEqual(["Speed, m/s", "", "0", "mean", "no value"]);
  expect([lines[2]!.count, lines.map((line) => line.isBar)]).toEqual(["4", [false, true, false, false, false]]);
});

test("few agents, and agents that can be seen, are no crowd", () => {
  const many = { agents: { length: 10_000 } } as unknown as Bodies;
  const few = { agents: { length: 100 } } as unknown as Bodies;
  expect([isCrowd(many, 0.5, 4), isCrowd(many, 0.5, 20), isCrowd(few, 0.5, 4)]).toEqual([true, false, false]);
});

test("agents are listed below their groups, which close, and are found by the group's name", () => {
  const all = bodies();
  const words = (filter: string, closed: number[] = []): string[] =>
    rowsOf(all, findAgents(all, filter), new Set(closed)).map((row) =>
      row.kind === "group" ? `${row.name} ${row.count}` : all.name(row.index),
    );
  expect(words("")).toEqual(["couriers 2", "robot 0", "robot 1", "guards 2", "robot 2", "Anna"]);
  expect(words("", [0])).toEqual(["couriers 2", "guards 2", "robot 2", "Anna"]);
  expect(words("guard")).toEqual(["guards 2", "robot 2", "Anna"]);
  expect(words("guard anna")).toEqual(["guards 1", "Anna"]);
  expect(words("nobody")).toEqual([]);
});

test("rows know their places, of which the page shows only some", () => {
  const all = bodies();
  const places = rowsOf(all, findAgents(all, ""), new Set([0])).map(({ place, places }) => `${place}/${places}`);
  expect(places).toEqual(["1/2", "2/2", "1/2", "2/2"]);
});
