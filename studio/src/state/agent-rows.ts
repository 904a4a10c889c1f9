/** The rows of the list of agents: those that a filter finds, below headings where agents have groups. */

import type { Bodies } from "./bodies";

/** The place of a row among those beside it, from 1 on, and their number: the page has only the rows that can be seen. */
interface RowPlace {
  place: number;
  places: number;
}

export type AgentRow = RowPlace &
  ({ kind: "group"; group: number; name: string; count: number; isClosed: boolean } | { kind: "agent"; index: number });

/** Returns the agents that have all words of a filter in their names or in that of their group. */
export function findAgents(bodies: Bodies, filter: string): number[] {
  const words = filter.trim().toLowerCase().split(/\s+/).filter(Boolean);
  if (words.length === 0) return [...bodies.agents];
  const groupNames = bodies.groups.map(({ name }) => name.toLowerCase());
  return [...bodies.agents].filter((index) => {
    const group = groupNames[bodies.groupOf[index]!] ?? "";
    const text = `${bodies.name(index).toLowerCase()} ${group}`;
    return words.every((word) => text.includes(word));
  });
}

/** Returns the rows for some agents; those of closed groups are left out. Agents without a group come last. */
export function rowsOf(bodies: Bodies, agents: readonly number[], closed: ReadonlySet<number>): AgentRow[] {
  const rowsOfAgents = (indices: readonly number[]): AgentRow[] =>
    indices.map((index, k) => ({ kind: "agent", index, place: k + 1, places: indices.length }));
  if (bodies.groups.length < 2) return rowsOfAgents(agents);
  const members = new Map<number, number[]>();
  for (const index of agents) {
    const group = bodies.groupOf[index]!;
    const known = members.get(group);
    if (known) known.push(index);
    else members.set(group, [index]);
  }
  const order = [...members.keys()].sort((a, b) => (a < 0 ? Infinity : a) - (b < 0 ? Infinity : b));
  return order.flatMap((group, k): AgentRow[] => {
    const own = members.get(group)!;
    const isClosed = closed.has(group);
    const name = bodies.groups[group]?.name ?? "others";
    const rowPlace = { place: k + 1, places: order.length };
    const heading: AgentRow = { kind: "group", group, name, count: own.length, isClosed, ...rowPlace };
    return [heading, ...(isClosed ? [] : rowsOfAgents(own))];
  });
}
