/** Events of a session: fetched as the run advances, kept when it goes back, because a run is deterministic. */

import type { ReplyBody, RunEvent } from "../protocol";
import { bodyKey } from "../format";

/** Maximum number of events that the page keeps. */
const MAX_EVENTS = 20_000;
/** Maximum number of events per request; the server's own limit is higher. */
const MAX_EVENTS_PER_REQUEST = 2000;

/** Least time between two additions of events of frames: lists and ticks made anew for each frame cost more than its picture. */
const ADD_INTERVAL_MS = 300;

/** Requests the events of the cycles `from` to before `until`, without the first `skip` ones. */
type FetchEvents = (from: number, until: number, skip: number, limit: number) => Promise<ReplyBody>;

function keyOf(event: RunEvent): string {
  const body = event.body ? bodyKey(event.body) : "";
  const other = event.other ? bodyKey(event.other) : "";
  return `${event.cycle}|${event.kind}|${body}|${other}|${event.text}`;
}

export class Events {
  /** Events in the order of cycles. */
  list = $state.raw<RunEvent[]>([]);
  /** Kinds that have occurred, with their counts. */
  kinds = $state.raw<Map<string, number>>(new Map());
  /** Kinds that lists, timeline and jumps leave out. */
  hiddenKinds = $state.raw<ReadonlySet<string>>(new Set());
  leftOut = $state(0);
  /** Number of events that were fetched, of which the list keeps the newest. */
  fetched = $state(0);
  /** All events before this cycle were fetched. */
  #fetchedUntil = 0;
  #isFetching = false;
  #age = 0;
  /** Events of frames that are added together. */
  #waiting: RunEvent[] = [];
  #timer: ReturnType<typeof setTimeout> | null = null;

  clear(): void {
    this.#waiting = [];
    if (this.#timer !== null) clearTimeout(this.#timer);
    this.#timer = null;
    this.list = [];
    this.kinds = new Map();
    this.leftOut = 0;
    this.fetched = 0;
    this.#fetchedUntil = 0;
    this.#age++;
    this.#isFetching = false;
  }

  /** Fetches the events before this cycle; one request at a time. */
  async fetch(until: number, ask: FetchEvents): Promise<void> {
    if (this.#isFetching || until <= this.#fetchedUntil) return;
    const age = this.#age;
    this.#isFetching = true;
    try {
      await this.#fetchAll(age, until, ask);
    } finally {
      if (age === this.#age) this.#isFetching = false;
    }
  }

  /** The server returns the oldest events first: continues after the last of them until none is left. */
  async #fetchAll(age: number, until: number, ask: FetchEvents): Promise<void> {
    // Events of the first cycle that earlier replies cut off: collected, because equal events are distinguished by count.
    let partial: RunEvent[] = [];
    while (true) {
      const from = this.#fetchedUntil;
      const answer = await ask(from, until, partial.length, MAX_EVENTS_PER_REQUEST);
      if (age !== this.#age || answer.is !== "events") return;
      const entries = [...partial, ...answer.entries];
      const last = entries.at(-1);
      if (!last || answer.entries.length < MAX_EVENTS_PER_REQUEST || answer.left_out === 0) {
        this.add(entries);
        // Events left out now are not on the server either: it never kept them.
        this.leftOut += answer.left_out;
        this.#fetchedUntil = Math.max(from, Math.min(until, answer.known_until));
        return;
      }
      // The last cycle may be incomplete.
      partial = entries.filter(({ cycle }) => cycle === last.cycle);
      this.add(entries.filter(({ cycle }) => cycle < last.cycle));
      this.#fetchedUntil = last.cycle;
    }
  }

  /** Adds the events of a frame: at once after a pause between frames, else together with those of the next ones. */
  addOfFrame(entries: readonly RunEvent[]): void {
    this.#waiting.push(...entries);
    if (this.#timer !== null || this.#waiting.length === 0) return;
    this.#addWaiting();
    this.#timer = setTimeout(() => {
      this.#timer = null;
      this.addOfFrame([]);
    }, ADD_INTERVAL_MS);
  }

  #addWaiting(): void {
    const entries = this.#waiting;
    this.#waiting = [];
    this.add(entries);
  }

  /** Adds events that are not known yet. */
  add(entries: RunEvent[]): void {
    if (entries.length === 0) return;
    const from = Math.min(...entries.map((event) => event.cycle));
    // Where the world gives no kind, the level at least shows the severity.
    entries = entries.map((event) => (event.kind === "" ? { ...event, kind: event.level } : event));
    // Events may be equal: each key occurs as often as in one reply, however often it is fetched.
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
    this.fetched += fresh.length;
    const all = [...this.list, ...fresh].sort((a, b) => a.cycle - b.cycle);
    this.list = all.slice(-MAX_EVENTS);
    const kinds = new Map<string, number>();
    for (const event of this.list) kinds.set(event.kind, (kinds.get(event.kind) ?? 0) + 1);
    this.kinds = kinds;
  }

  /** Number of all events so far, those that no list has included. */
  get total(): number {
    return this.fetched + this.leftOut;
  }

  /** The events of kinds that are not hidden. */
  get visible(): RunEvent[] {
    return this.list.filter((event) => !this.hiddenKinds.has(event.kind));
  }

  /** Hides a kind, or shows it again. */
  toggleKind(kind: string): void {
    const hidden = new Set(this.hiddenKinds);
    const wasHidden = hidden.delete(kind);
    if (!wasHidden) hidden.add(kind);
    this.hiddenKinds = hidden;
  }

  /** The first visible event after a cycle, or the last one before it. */
  neighbor(cycle: number, direction: 1 | -1): RunEvent | undefined {
    this.#addWaiting();
    if (direction > 0) return this.visible.find((event) => event.cycle > cycle);
    return this.visible.findLast((event) => event.cycle < cycle);
  }
}
