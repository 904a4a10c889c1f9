/** One history of texts for all three views: every step is a whole text, and none is ever dropped. */

/** Steps of one group that follow each other within this time are one. */
const GROUP_MS = 1000;

export class History {
  readonly #past: string[] = [];
  #future: string[] = [];
  #now: string;
  #group: string | null = null;
  #at_ms = 0;

  constructor(text: string) {
    this.#now = text;
  }

  get now(): string {
    return this.#now;
  }

  get canUndo(): boolean {
    return this.#past.length > 0;
  }

  get canRedo(): boolean {
    return this.#future.length > 0;
  }

  /** Adds a step. Texts that follow quickly in the same group, as in typing, belong to the step before. */
  push(text: string, group: string | null, now_ms: number): void {
    if (text === this.#now) return;
    const continues = group !== null && group === this.#group && now_ms - this.#at_ms < GROUP_MS;
    if (!continues) this.#past.push(this.#now);
    this.#now = text;
    this.#future = [];
    this.#group = group;
    this.#at_ms = now_ms;
  }

  /** Goes one step back. Returns whether there was one. */
  undo(): boolean {
    return this.#go(this.#past, this.#future);
  }

  redo(): boolean {
    return this.#go(this.#future, this.#past);
  }

  #go(from: string[], to: string[]): boolean {
    const text = from.pop();
    if (text === undefined) return false;
    to.push(this.#now);
    this.#now = text;
    this.#group = null;
    return true;
  }
}
