/** Narrower tables of an inspection. */

import type { Fact, FactTable } from "../protocol";

/** Returns constant columns as facts, and the table without them. A table of one row stays unchanged. */
export function hoistConstantColumns({ columns, rows }: FactTable): FactTable & { same: Fact[] } {
  const [first, ...others] = rows;
  if (!first || others.length === 0) return { same: [], columns, rows };
  const words = first.map((value) => JSON.stringify(value));
  const isSame = columns.map((_, k) => others.every((row) => JSON.stringify(row[k]) === words[k]));
  if (isSame.every((is) => is)) return { same: [], columns, rows };
  const kept = <T>(list: readonly T[]): T[] => list.filter((_, k) => !isSame[k]);
  const same = columns.flatMap((label, k) => (isSame[k] ? [{ label, value: first[k]! }] : []));
  return { same, columns: kept(columns), rows: rows.map(kept) };
}
