/** The first difference of two runs is found, with few cycles computed beyond it. */

import { expect, test } from "vitest";
import { bodyDifferences, firstDifference } from "../../src/state/difference";
import { Bodies } from "../../src/state/bodies";
import { decodeFrame, type Frame } from "../../src/decode";
import type { BodyTable } from "../../src/protocol";
import { encodeFrame } from "../fake/encode";

/** Asks for the first difference of runs that part at a cycle; returns the questions, too. */
async function searched(last: number, parting: number): Promise<{ found: number | null; asked: number[] }> {
  const asked: number[] = [];
  const found = await firstDifference(last, (cycle) => (asked.push(cycle), Promise.resolve(cycle >= parting)));
  return { found, asked };
}

test("the first difference is found at every cycle, or none", async () => {
  for (const last of [0, 1, 2, 3, 100]) {
    for (let parting = 0; parting <= last; parting++)
      expect((await searched(last, parting)).found, `${parting} of ${last}`).toBe(parting);
    expect((await searched(last, last + 1)).found).toBeNull();
  }
});

test("an early difference in a long run needs few comparisons", async () => {
  const { found, asked } = await searched(1e9, 1000);
  expect(found).toBe(1000);
  expect(Math.max(...asked)).toBeLessThanOrEqual(2000);
  expect(asked.length).toBeLessThan(25);
});

function bodies(numbers: number[]): Bodies {
  const zeros = numbers.map(() => 0);
  return new Bodies({
    session: 1,
    tableId: 1,
    kinds: ["robot"],
    kind: zeros,
    number: numbers,
    part: numbers.map(() => -1),
    is_agent: numbers.map(() => true),
    names: [],
    shapes: [{ type: "sphere", radius_m: 1 }],
    shape: zeros,
    appearances: [],
    appearance: zeros,
  } as unknown as BodyTable);
}

function frame(positions_m: number[], orientations: number[], conditions: number[]): Frame {
  return decodeFrame(
    encodeFrame({
      session: 1,
      tableId: 1,
      dimensions: 2,
      cycle: 1,
      time_s: 0,
      positions_m,
      orientations,
      lines: [],
      conditions,
    }),
  );
}

test("bodies are matched by identity, in any order", () => {
  const a = { bodies: bodies([1, 2, 3, 4]), frame: frame([0, 0, 1, 1, 2, 2, 3, 3], [0, 0, 0, 0], [0, 0, 0, 0]) };
  const b = { bodies: bodies([3, 2, 1, 5]), frame: frame([2, 2, 1, 1, 0, 3, 9, 9], [1, 0, 0, 0], [0, 2, 0, 0]) };
  const listed = bodyDifferences(a, b, (m) => `${m} m`).map(({ body, words }) => `${body.number} ${words}`);
  expect(listed).toEqual([
    "1 is 3 m apart",
    "2 has another condition",
    "3 has another heading",
    "4 exists in only one of them",
    "5 exists in only one of them",
  ]);
});

test("runs with equal frames have no differing bodies", () => {
  const one = { bodies: bodies([1]), frame: frame([0, 0], [0], [0]) };
  expect(bodyDifferences(one, one, String)).toEqual([]);
});
