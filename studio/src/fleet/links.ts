/** Links of a fleet: pairs that hear each other. */

import { whoKey } from "../format";
import type { Fleet, Node, Who } from "../protocol";

/** Two agents by their numbers on the network, of which the second hears the first; where both hear each other there is one link. */
export interface Link {
  from: number;
  to: number;
  isMutual: boolean;
}

/** The node of the agent that a body is, if it is one's. */
export function nodeOf(fleet: Fleet, who: Who): Node | undefined {
  const key = whoKey(who);
  return fleet.nodes.find((node) => whoKey(node.who) === key);
}

/** The links of a fleet, or of one agent of it; of all where `selected` is none. */
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

/** People's words for the state of a node: it is there, late, or not. */
export type Health = "well" | "late" | "away";

/** Seconds without a sign of a node after which it is reported as late. */
const LATE_S = 2;

export function healthOf(node: Node): Health {
  if (node.state === "gone" || node.state === "awaited") return "away";
  return (node.silent_s ?? 0) > LATE_S ? "late" : "well";
}

/** A few words for a fleet as a whole. */
export function fleetWords(fleet: Fleet): string {
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
