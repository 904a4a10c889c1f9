/** The rows of the list of agents: those that a filter finds, below headings where agents have groups. */

import type { Bodies } from "./bodies";

export type AgentRow =
  { kind: "group"; group: number; name: string; count: number; isFolded: boolean } | { kind: "agent"; index: number };

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

/** Returns the rows for some agents; those of folded groups are left out. Agents without a group come last. */
export function rowsOf(bodies: Bodies, agents: readonly number[], folded: ReadonlySet<number>): AgentRow[] {
  const rowOf = (index: number): AgentRow => ({ kind: "agent", index });
  if (bodies.groups.length < 2) return agents.map(rowOf);
  const members = new Map<number, number[]>();
  for (const index of agents) {
    const group = bodies.groupOf[index]!;
    const known = members.get(group);
    if (known) known.push(index);
    else members.set(group, [index]);
  }
  const order = [...members.keys()].sort((a, b) => (a < 0 ? Infinity : a) - (b < 0 ? Infinity : b));
  return order.flatMap((group): AgentRow[] => {
    const own = members.get(group)!;
    const isFolded = folded.has(group);
    const name = bodies.groups[group]?.name ?? "others";
    const heading: AgentRow = { kind: "group", group, name, count: own.length, isFolded };
    return [heading, ...(isFolded ? [] : own.map(rowOf))];
  });
}
