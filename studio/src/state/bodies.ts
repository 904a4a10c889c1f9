/** The bodies behind the columns of frames, with names and lookup. */

import { bodyKey, bodyLabel } from "../format";
import type { BodyId, BodyName, BodyTable, SceneGroup } from "../protocol";

/** Agents that belong together: a group of the scenario, or the parts of one object. */
export interface BodyGroup {
  name: string;
  /** Number of its agents. */
  count: number;
}

export class Bodies {
  readonly table: BodyTable;
  readonly count: number;
  /** Indices of the bodies that can be inspected. */
  readonly agents: Uint32Array;
  /** Indices of the bodies that are lines, in the order of a frame's lines. */
  readonly lines: Uint32Array;
  /** The groups of agents; none where nothing distinguishes them. */
  readonly groups: readonly BodyGroup[];
  /** The group of each body; -1 for none. */
  readonly groupOf: Int32Array;
  readonly #names: Map<number, string>;
  /** Names of bodies that may be absent, by kind and number. */
  readonly #sceneNames: Map<string, string>;
  readonly #indexByKey = new Map<string, number>();

  constructor(table: BodyTable, groups: readonly SceneGroup[] = [], names: readonly BodyName[] = []) {
    this.table = table;
    this.#sceneNames = namesByBody(names);
    this.count = table.kind.length;
    this.#names = new Map(table.names);
    const agents: number[] = [];
    const lines: number[] = [];
    for (let i = 0; i < this.count; i++) {
      if (table.is_agent[i]) agents.push(i);
      if (table.shapes[table.shape[i]!]!.type === "line") lines.push(i);
      this.#indexByKey.set(bodyKey(this.bodyId(i)), i);
    }
    this.agents = Uint32Array.from(agents);
    this.lines = Uint32Array.from(lines);
    this.groupOf = new Int32Array(this.count).fill(-1);
    this.groups = groups.length > 0 ? this.#fillGroups(groups) : this.#fillObjects();
  }

  /** Puts agents into the groups of the scenario. */
  #fillGroups(groups: readonly SceneGroup[]): BodyGroup[] {
    const { kinds, kind, number } = this.table;
    const counts = groups.map(() => 0);
    for (const i of this.agents) {
      const at = groups.findIndex(
        (group) =>
          group.kind === kinds[kind[i]!] && number[i]! >= group.first && number[i]! < group.first + group.count,
      );
      this.groupOf[i] = at;
      if (at >= 0) counts[at]!++;
    }
    return groups.map(({ name }, at) => ({ name, count: counts[at]! }));
  }

  /** Where agents are parts of objects, each object is a group; its other bodies, such as rods, belong to it. */
  #fillObjects(): BodyGroup[] {
    const { number, part } = this.table;
    const groups: BodyGroup[] = [];
    const byNumber = new Map<number, number>();
    for (const i of this.agents) {
      if (part[i]! < 0) return [];
      let at = byNumber.get(number[i]!);
      if (at === undefined) {
        at = groups.length;
        byNumber.set(number[i]!, at);
        groups.push({ name: this.#names.get(i) ?? `object ${number[i]}`, count: 0 });
      }
      groups[at]!.count++;
    }
    for (let i = 0; i < this.count; i++) this.groupOf[i] = byNumber.get(number[i]!) ?? -1;
    return groups;
  }

  bodyId(index: number): BodyId {
    const part = this.table.part[index]!;
    return {
      kind: this.table.kinds[this.table.kind[index]!]!,
      number: this.table.number[index]!,
      part: part < 0 ? null : part,
    };
  }

  /** The body's own name, or its kind and number. Parts share the name of their object. */
  name(index: number): string {
    const name = this.#names.get(index);
    const part = this.table.part[index]!;
    if (name === undefined) return bodyLabel(this.bodyId(index));
    return part < 0 ? name : `${name} ${part}`;
  }

  /** The name of the object that a body is a part of. */
  wholeName(index: number): string {
    return this.#names.get(index) ?? this.name(index);
  }

  /** Agents with names of their own; an object of many parts once. */
  get namedAgents(): [number, string][] {
    return this.table.names.filter(([index]) => this.table.is_agent[index] && this.table.part[index]! <= 0);
  }

  nameOf(id: BodyId): string {
    const index = this.find(id);
    if (index !== undefined) return this.name(index);
    const name = this.#sceneNames.get(`${id.kind} ${id.number}`);
    return name === undefined ? bodyLabel(id) : id.part === null ? name : `${name} ${id.part}`;
  }

  find(id: BodyId): number | undefined {
    return this.#indexByKey.get(bodyKey(id));
  }

  /** Returns whether a body exists here and is an agent. */
  isAgent(id: BodyId): boolean {
    const index = this.find(id);
    return index !== undefined && this.table.is_agent[index] === true;
  }
}

/** Names by kind and number. */
export function namesByBody(names: readonly BodyName[]): Map<string, string> {
  return new Map(names.map(({ kind, number, name }) => [`${kind} ${number}`, name]));
}
