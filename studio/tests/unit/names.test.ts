/** Names of bodies, of those that are there and of others. */

import { expect, test } from "vitest";
import type { BodyTable } from "../../src/protocol";
import { Bodies } from "../../src/state/bodies";

test("an airplane that is gone, or not there yet, keeps its name", () => {
  const table = {
    kinds: ["airplane"],
    kind: [0],
    number: [4],
    part: [-1],
    shapes: [{ type: "sphere", radius_m: 1 }],
    shape: [0],
    names: [[0, "KLM4"]],
    is_agent: [true],
  } as unknown as BodyTable;
  const names = [4, 5].map((number) => ({ kind: "airplane", number, name: `KLM${number}` }));
  const bodies = new Bodies(table, [], names);
  const named = [4, 5, 6].map((number) => bodies.nameOf({ kind: "airplane", number, part: null }));
  expect(named).toEqual(["KLM4", "KLM5", "airplane 6"]);
  expect(bodies.nameOf({ kind: "airplane", number: 5, part: 2 })).toBe("KLM5 2");
});
