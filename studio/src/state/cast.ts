/** The bodies that columns stand for, with their names and where to find them. */

import { whoKey, whoWords } from "../format";
import type { Cast, Who } from "../protocol";

export class Bodies {
  readonly cast: Cast;
  readonly count: number;
  /** Indices of the bodies that can be inspected. */
  readonly agents: Uint32Array;
  /** Indices of the bodies that are lines, in the order of a frame's lines. */
  readonly lines: Uint32Array;
  readonly #names: Map<number, string>;
  readonly #byWho = new Map<string, number>();

  constructor(cast: Cast) {
    this.cast = cast;
    this.count = cast.kind.length;
    this.#names = new Map(cast.names);
    const agents: number[] = [];
    const lines: number[] = [];
    for (let i = 0; i < this.count; i++) {
      if (cast.is_agent[i]) agents.push(i);
      if (cast.shapes[cast.shape[i]!]!.type === "line") lines.push(i);
      this.#byWho.set(whoKey(this.who(i)), i);
    }
    this.agents = Uint32Array.from(agents);
    this.lines = Uint32Array.from(lines);
  }

  who(index: number): Who {
    const part = this.cast.part[index]!;
    return {
      kind: this.cast.kinds[this.cast.kind[index]!]!,
      number: this.cast.number[index]!,
      part: part < 0 ? null : part,
    };
  }

  /** The body's own name, or its kind and number. Parts share the name of the whole. */
  name(index: number): string {
    const name = this.#names.get(index);
    const part = this.cast.part[index]!;
    if (name === undefined) return whoWords(this.who(index));
    return part < 0 ? name : `${name} ${part}`;
  }

  /** The name of the whole that a body is a part of. */
  whole(index: number): string {
    return this.#names.get(index) ?? this.name(index);
  }

  /** Agents with names of their own, once for a thing of many parts. */
  get named(): [number, string][] {
    return this.cast.names.filter(([index]) => this.cast.is_agent[index] && this.cast.part[index]! <= 0);
  }

  nameOf(who: Who): string {
    const index = this.find(who);
    return index === undefined ? whoWords(who) : this.name(index);
  }

  find(who: Who): number | undefined {
    return this.#byWho.get(whoKey(who));
  }
}
