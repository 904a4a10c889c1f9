/** Links of a fleet: pairs that hear each other. */

import { bodyKey } from "../format";
import type { Fleet, FleetNode, BodyId } from "../protocol";
import type { Bodies } from "../state/bodies";

/** Two agents by network number: the second hears the first. A mutual pair is one link. */
export interface Link {
  from: number;
  to: number;
  isMutual: boolean;
}

/** The node of a body's agent, if there is one. */
export function nodeOf(fleet: Fleet, body: BodyId): FleetNode | undefined {
  const key = bodyKey(body);
  return fleet.nodes.find((node) => bodyKey(node.body) === key);
}

/** The links of a fleet, or of its selected agent. */
export function linksOf(fleet: Fleet, selected: number | null): Link[] {
  const hears = new Map(fleet.nodes.map((node) => [node.agent, new Set(node.heard)]));
  const links: Link[] = [];
  for (const [to, heard] of hears) {
    for (const from of heard) {
      if (selected !== null && selected !== from && selected !== to) continue;
      const isMutual = hears.get(from)?.has(to) ?? false;
      if (!isMutual || from < to) links.push({ from, to, isMutual });
    }
  }
  return links;
}

/** The links of a fleet by the indices of bodies; of the selected agent alone where one is. */
export function linksBetweenBodies(fleet: Fleet, bodies: Pick<Bodies, "find">, selected: BodyId | null): Link[] {
  const indexOfAgent = new Map(fleet.nodes.map((node) => [node.agent, bodies.find(node.body)]));
  // A body that is no agent, such as an obstacle, has no links: all links stay visible.
  const node = selected ? nodeOf(fleet, selected) : undefined;
  return linksOf(fleet, node?.agent ?? null).flatMap((link) => {
    const from = indexOfAgent.get(link.from);
    const to = indexOfAgent.get(link.to);
    return from === undefined || to === undefined ? [] : [{ from, to, isMutual: link.isMutual }];
  });
}

/** Condition of a node: heard, late, or not connected. */
export type Health = "well" | "late" | "away";

/** Seconds without a message after which a node counts as late. */
const LATE_AFTER_S = 2;

export function healthOf(node: FleetNode): Health {
  if (node.state === "gone" || node.state === "awaited") return "away";
  return (node.silent_s ?? 0) > LATE_AFTER_S ? "late" : "well";
}

/** A short summary of a fleet. */
export function fleetSummary(fleet: Fleet): string {
  const count = (health: Health): number => fleet.nodes.filter((node) => healthOf(node) === health).length;
  const [away, late] = [count("away"), count("late")];
  const all = `${fleet.nodes.length} ${fleet.nodes.length === 1 ? "node" : "nodes"}`;
  const parts = [
    all,
    ...(late > 0 ? [`${late} late`] : []),
    ...(away > 0 ? [`${away} ${fleet.has_begun ? "lost" : "awaited"}`] : []),
  ];
  return parts.join(", ");
}
