/** A search over all events of a session, of which the page's own list has only the newest. */

import type { ReplyBody, RunEvent } from "../protocol";

/** Number of events that one request brings. */
export const EVENTS_PER_PAGE = 500;
/** Pause in typing before the search begins. */
const TYPING_PAUSE_MS = 200;

/** Asks for the events with these words, of these kinds, or of all. */
type FindEvents = (text: string, kinds: string[] | null, skip: number, limit: number) => Promise<ReplyBody>;

type Found = Extract<ReplyBody, { is: "found-events" }>;

export class EventSearch {
  text = $state("");
  /** What the last search has found; null without one. */
  found = $state.raw<Found | null>(null);
  kinds: readonly string[] | null = null;
  #round = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;
  /** Number of events that the shown result is of. */
  #searched = -1;

  get isActive(): boolean {
    return this.text.trim() !== "";
  }

  get entries(): readonly RunEvent[] {
    return this.found?.entries ?? [];
  }

  clear(): void {
    this.#round++;
    clearTimeout(this.#timer);
    this.found = null;
    this.#searched = -1;
  }

  /** Searches for a text once typing pauses. */
  type(text: string, kinds: readonly string[] | null, ask: FindEvents): void {
    this.text = text;
    this.kinds = kinds;
    this.clear();
    if (this.isActive) this.#timer = setTimeout(() => void this.#search(EVENTS_PER_PAGE, ask), TYPING_PAUSE_MS);
  }

  /** Searches again after more has happened; `total` events are known. */
  async refresh(total: number, ask: FindEvents): Promise<void> {
    if (!this.isActive || !this.found || total === this.#searched) return;
    this.#searched = total;
    await this.#search(Math.max(EVENTS_PER_PAGE, this.entries.length), ask);
  }

  /** Adds the next events that were found. */
  async more(ask: FindEvents): Promise<void> {
    const known = this.found;
    const round = this.#round;
    if (!known || known.entries.length >= known.found) return;
    const answer = await ask(this.text, this.#kindList, known.entries.length, EVENTS_PER_PAGE);
    if (round !== this.#round || answer.is !== "found-events") return;
    this.found = { ...answer, entries: [...known.entries, ...answer.entries] };
  }

  get #kindList(): string[] | null {
    return this.kinds === null ? null : [...this.kinds];
  }

  async #search(limit: number, ask: FindEvents): Promise<void> {
    const round = ++this.#round;
    const answer = await ask(this.text, this.#kindList, 0, limit);
    if (round === this.#round && answer.is === "found-events") this.found = answer;
  }
}
