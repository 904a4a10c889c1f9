/** Events of a session: fetched as the run goes on, kept when it goes back, because a run repeats itself. */

import type { Answer, Event } from "../protocol";
import { whoKey } from "../format";

/** Events that the page keeps at most. */
const MOST_KEPT = 20_000;
/** Events that one question asks for at most; the server would give some more. */
const MOST_ASKED = 2000;

/** Asks for the events from a cycle to before another one, without the first so many of them. */
type Ask = (from: number, until: number, skip: number, most: number) => Promise<Answer>;

function keyOf(event: Event): string {
  const who = event.who ? whoKey(event.who) : "";
  const other = event.with ? whoKey(event.with) : "";
  return `${event.cycle}|${event.kind}|${who}|${other}|${event.words}`;
}

export class Events {
  /** Events in the order of cycles. */
  list = $state.raw<Event[]>([]);
  /** Kinds that have occurred, with how often. */
  kinds = $state.raw<Map<string, number>>(new Map());
  leftOut = $state(0);
  /** All events before this cycle were asked for. */
  #asked = 0;
  #isAsking = false;
  #age = 0;

  clear(): void {
    this.list = [];
    this.kinds = new Map();
    this.leftOut = 0;
    this.#asked = 0;
    this.#age++;
    this.#isAsking = false;
  }

  /** Fetches the events before this cycle; one question at a time. */
  async fetch(until: number, ask: Ask): Promise<void> {
    if (this.#isAsking || until <= this.#asked) return;
    const age = this.#age;
    this.#isAsking = true;
    try {
      await this.#fetchAll(age, until, ask);
    } finally {
      if (age === this.#age) this.#isAsking = false;
    }
  }

  /** The server answers with the oldest: goes on from the last of them until none is left. */
  async #fetchAll(age: number, until: number, ask: Ask): Promise<void> {
    // Those of the first cycle that earlier answers had no more room for: together, because equal ones are told apart
    // by number.
    let begun: Event[] = [];
    while (true) {
      const from = this.#asked;
      const answer = await ask(from, until, begun.length, MOST_ASKED);
      if (age !== this.#age || answer.is !== "events") return;
      const told = [...begun, ...answer.entries];
      const last = told.at(-1);
      if (!last || answer.entries.length < MOST_ASKED || answer.left_out === 0) {
        this.add(told);
        // Events left out now are not at the server either: it never kept them.
        this.leftOut += answer.left_out;
        this.#asked = Math.max(from, Math.min(until, answer.known_until));
        return;
      }
      // The last cycle may be cut.
      begun = told.filter(({ cycle }) => cycle === last.cycle);
      this.add(told.filter(({ cycle }) => cycle < last.cycle));
      this.#asked = last.cycle;
    }
  }

  /** Adds events that are not known yet. */
  add(entries: Event[]): void {
    if (entries.length === 0) return;
    const from = Math.min(...entries.map((event) => event.cycle));
    // Where the world tells no kind, its level says at least how bad it is.
    entries = entries.map((event) => (event.kind === "" ? { ...event, kind: event.level } : event));
    // Events may be equal: of each sort there are as many as one answer has, however often it is told.
    const known = new Map<string, number>();
    for (let i = this.list.length - 1; i >= 0 && this.list[i]!.cycle >= from; i--) {
      const key = keyOf(this.list[i]!);
      known.set(key, (known.get(key) ?? 0) + 1);
    }
    const fresh = entries.filter((event) => {
      const key = keyOf(event);
      const left = known.get(key) ?? 0;
      known.set(key, left - 1);
      return left <= 0;
    });
    if (fresh.length === 0) return;
    const all = [...this.list, ...fresh].sort((a, b) => a.cycle - b.cycle);
    this.list = all.slice(-MOST_KEPT);
    const kinds = new Map<string, number>();
    for (const event of this.list) kinds.set(event.kind, (kinds.get(event.kind) ?? 0) + 1);
    this.kinds = kinds;
  }

  /** The first event after a cycle, or the last before it, of those that pass. */
  neighbor(cycle: number, direction: 1 | -1, passes: (event: Event) => boolean): Event | undefined {
    const found = (event: Event): boolean => passes(event) && direction * (event.cycle - cycle) > 0;
    return direction > 0 ? this.list.find(found) : this.list.findLast(found);
  }
}
