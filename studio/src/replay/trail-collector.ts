/** Trails of a replay, from its own frames. */

import { bodyKey } from "../format";
import type { BodyId, BodyTable, BodyTrail } from "../protocol";
import type { FrameColumns } from "./chunk";

export class TrailCollector {
  readonly #trails = new Map<string, BodyTrail>();
  /** The trail of each body of a table, which stays the same for many frames. */
  readonly #byTable = new Map<number, (BodyTrail | undefined)[]>();

  /** Collects the trails of some agents of a table; of all where none is named. */
  constructor(present: BodyTable, bodies: readonly BodyId[]) {
    const wanted = new Set(bodies.map(bodyKey));
    for (const body of agentsOf(present)) {
      if (!body) continue;
      const key = bodyKey(body);
      if (wanted.size === 0 || wanted.has(key)) this.#trails.set(key, { body, cycles: [], points_m: [] });
    }
  }

  get trails(): BodyTrail[] {
    return [...this.#trails.values()];
  }

  add(cycle: number, { dimensions: d, places }: FrameColumns, table: BodyTable): void {
    let trails = this.#byTable.get(table.id);
    if (!trails) {
      trails = agentsOf(table).map((body) => (body ? this.#trails.get(bodyKey(body)) : undefined));
      this.#byTable.set(table.id, trails);
    }
    trails.forEach((trail, index) => {
      if (!trail) return;
      trail.cycles.push(cycle);
      trail.points_m.push(places[d * index]!, places[d * index + 1]!, d === 3 ? places[3 * index + 2]! : 0);
    });
  }
}

/** The agents of a table at their indices; undefined for other bodies. */
function agentsOf(table: BodyTable): (BodyId | undefined)[] {
  return table.is_agent.map((isAgent, index) => {
    if (!isAgent) return undefined;
    const part = table.part[index]!;
    const kind = table.kinds[table.kind[index]!]!;
    return { kind, number: table.number[index]!, part: part < 0 ? null : part };
  });
}
