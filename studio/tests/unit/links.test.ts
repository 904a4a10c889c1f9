/** Links and health of a fleet's nodes. */

import { describe, expect, test } from "vitest";
import { fleetSummary, healthOf, linksBetweenBodies, linksOf, nodeOf } from "../../src/fleet/links";
import type { Fleet, FleetNode } from "../../src/protocol";

function node(agent: number, heard: number[], more: Partial<FleetNode> = {}): FleetNode {
  return {
    agent,
    body: { kind: "airplane", number: agent, part: null },
    heard,
    state: "done",
    epoch: 1,
    round: 2,
    flown: 3,
    late: 0,
    lives: 1,
    packets_per_s: 4,
    bytes_per_s: 5,
    silent_s: 0.1,
    ...more,
  };
}

function fleet(nodes: FleetNode[], has_begun = true): Fleet {
  return { has_begun, silent_s: 0, late_cycles: 0, talk_p50_ms: null, talk_p99_ms: null, nodes };
}

describe("links", () => {
  test("nodes that hear each other have one mutual link, others a one-sided one", () => {
    const all = fleet([node(0, [1]), node(1, [0]), node(2, [0])]);
    expect(linksOf(all, null)).toEqual([
      { from: 0, to: 1, isMutual: true },
      { from: 0, to: 2, isMutual: false },
    ]);
    expect(linksOf(all, 1)).toEqual([{ from: 0, to: 1, isMutual: true }]);
    expect(linksOf(all, 3)).toEqual([]);
  });
});

test("links between bodies use the indices of bodies, and omit nodes that have none", () => {
  const all = fleet([node(0, [1]), node(1, [0]), node(2, [0])]);
  const bodies = { find: ({ number }: { number: number }) => (number === 2 ? undefined : 10 + number) };
  const links = [{ from: 10, to: 11, isMutual: true }];
  expect(linksBetweenBodies(all, bodies, null)).toEqual(links);
  expect(linksBetweenBodies(all, bodies, { kind: "obstacle", number: 0, part: null })).toEqual(links);
  expect(linksBetweenBodies(all, bodies, { kind: "airplane", number: 2, part: null })).toEqual([]);
});

describe("nodes", () => {
  test("are found by the bodies of their agents, including parts", () => {
    const connector = (agent: number, number: number, part: number): FleetNode =>
      node(agent, [], { body: { kind: "connector", number, part } });
    const all = fleet([connector(0, 0, 0), connector(1, 0, 1), connector(2, 1, 0)]);
    expect(nodeOf(all, { kind: "connector", number: 1, part: 0 })?.agent).toBe(2);
    expect(nodeOf(all, { kind: "connector", number: 0, part: 1 })?.agent).toBe(1);
    expect(nodeOf(all, { kind: "obstacle", number: 0, part: null })).toBeUndefined();
  });

  test("are well, late or away", () => {
    expect(
      [
        node(0, []),
        node(0, [], { silent_s: 3 }),
        node(0, [], { state: "gone" }),
        node(0, [], { silent_s: null, state: "awaited" }),
      ].map(healthOf),
    ).toEqual(["well", "late", "away", "away"]);
  });

  test("have a short summary", () => {
    expect(fleetSummary(fleet([node(0, [])]))).toBe("1 node");
    expect(fleetSummary(fleet([node(0, []), node(1, [], { state: "gone" }), node(2, [], { silent_s: 9 })]))).toBe(
      "3 nodes, 1 late, 1 lost",
    );
    expect(fleetSummary(fleet([node(0, [], { state: "awaited" })], false))).toBe("1 node, 1 awaited");
  });
});
