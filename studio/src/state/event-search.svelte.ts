/** A search over all events of a session, of which the page's own list has only the newest. */

import { RequestError } from "../connection";
import type { Problem, ReplyBody, RunEvent } from "../protocol";
import { Pace } from "./pace";

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
  /** Why the last search has failed; null once one succeeds. */
  problem = $state.raw<Problem | null>(null);
  kinds: readonly string[] | null = null;
  #round = 0;
  /** Set while typing may go on. */
  #timer: ReturnType<typeof setTimeout> | undefined;
  /** Number of events that the last reply was of, by the server's count. */
  #searched = -1;
  /** Number of events that were known at the last search that was answered, by the page's count. */
  #known = -1;
  #openRequests = 0;
  readonly #pace = new Pace();

  get isActive(): boolean {
    return this.text.trim() !== "";
  }

  get entries(): readonly RunEvent[] {
    return this.found?.entries ?? [];
  }

  /** Drops what was found; what is typed is searched again by the next `refresh`. */
  clear(): void {
    this.#round++;
    clearTimeout(this.#timer);
    this.#timer = undefined;
    this.found = null;
    this.problem = null;
    this.#searched = -1;
    this.#known = -1;
    this.#pace.reset();
  }

  /** Searches for a text once typing pauses. */
  type(text: string, kinds: readonly string[] | null, ask: FindEvents): void {
    this.text = text;
    this.kinds = kinds;
    this.clear();
    if (!this.isActive) return;
    this.#timer = setTimeout(() => {
      this.#timer = undefined;
      void this.#search(EVENTS_PER_PAGE, ask);
    }, TYPING_PAUSE_MS);
  }

  /** Searches again after more has happened, or after the last search was lost; `total` events are known. */
  async refresh(total: number, ask: FindEvents): Promise<void> {
    if (!this.isActive || this.#timer !== undefined || this.#openRequests > 0 || !this.#pace.isDue) return;
    if (this.found && (total === this.#searched || total === this.#known)) return;
    const isAnswered = await this.#search(Math.max(EVENTS_PER_PAGE, this.entries.length), ask);
    if (isAnswered) this.#known = total;
  }

  /** Adds the next events that were found. */
  async more(ask: FindEvents): Promise<void> {
    const known = this.found;
    if (!known || known.entries.length >= known.found) return;
    const answer = await this.#request(this.#round, known.entries.length, EVENTS_PER_PAGE, ask);
    if (answer) this.found = { ...answer, entries: [...known.entries, ...answer.entries] };
  }

  get #kindList(): string[] | null {
    return this.kinds === null ? null : [...this.kinds];
  }

  /** Returns whether the result is shown. */
  async #search(limit: number, ask: FindEvents): Promise<boolean> {
    const answer = await this.#request(++this.#round, 0, limit, ask);
    if (!answer) return false;
    this.found = answer;
    this.#searched = answer.searched;
    return true;
  }

  /** Asks for events; null if that failed, or if the answer is of an earlier search. */
  async #request(round: number, skip: number, limit: number, ask: FindEvents): Promise<Found | null> {
    const sentAt_ms = performance.now();
    this.#openRequests++;
    try {
      const answer = await ask(this.text, this.#kindList, skip, limit);
      if (round !== this.#round || answer.is !== "found-events") return null;
      this.problem = null;
      return answer;
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      if (round === this.#round) this.problem = error.problem;
      return null;
    } finally {
      this.#openRequests--;
      if (round === this.#round) this.#pace.onReply(sentAt_ms);
    }
  }
}
