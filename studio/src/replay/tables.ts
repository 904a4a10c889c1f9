/** Body tables of a replay: selections of the bodies of some consecutive ones; see the server's `replay_page/tables.rs`. */

import type { BodyTable, ReplayTablesPart } from "../protocol";

/** The table with an index in a part; `id` is its number, to which frames refer. */
export function selectTable({ all, changes }: ReplayTablesPart, index: number, id: number): BodyTable {
  if (index >= changes.length) throw new Error(`there is no body table ${id}: the file is not whole`);
  const isPresent = new Uint8Array(all.kind.length);
  for (const change of changes.slice(0, index + 1)) for (const body of change) isPresent[body]! ^= 1;
  const own = <T>(column: T[]): T[] => column.filter((_, body) => isPresent[body] === 1);
  // The index of each body in the table: the number of bodies before it that are there.
  let before = 0;
  const indexOf = Uint32Array.from(isPresent, (isThere) => (before += isThere) - isThere);
  return {
    ...all,
    id,
    kind: own(all.kind),
    number: own(all.number),
    part: own(all.part),
    shape: own(all.shape),
    appearance: own(all.appearance),
    is_agent: own(all.is_agent),
    names: all.names.filter(([body]) => isPresent[body]).map(([body, name]) => [indexOf[body]!, name]),
  };
}
