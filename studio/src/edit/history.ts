/** The undo history of the text, shared by all three views: every step is a whole text, and none is dropped. */

/** Steps of one group within this time count as one. */
const GROUP_MS = 1000;

export class TextHistory {
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

  /** Adds a step. Quick successive texts of the same group, as in typing, extend the last step. */
  push(text: string, group: string | null, now_ms: number): void {
    if (text === this.#now) return;
    const continues = group !== null && group === this.#group && now_ms - this.#at_ms < GROUP_MS;
    if (!continues) this.#past.push(this.#now);
    this.#now = text;
    this.#future = [];
    this.#group = group;
    this.#at_ms = now_ms;
  }

  /** Undoes a step. Returns whether there was one. */
  undo(): boolean {
    return this.#move(this.#past, this.#future);
  }

  redo(): boolean {
    return this.#move(this.#future, this.#past);
  }

  #move(from: string[], to: string[]): boolean {
    const text = from.pop();
    if (text === undefined) return false;
    to.push(this.#now);
    this.#now = text;
    this.#group = null;
    return true;
  }
}
