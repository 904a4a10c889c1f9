/** The way to cycles that were asked for: one at a time, and of further wishes the latest only. */

export class Seeker {
  #wish: number | null = null;
  #going: number | null = null;
  #way: Promise<boolean> | null = null;
  #isSought = false;
  readonly #go: (cycle: number) => Promise<boolean>;

  /** `go` asks the server, and tells whether it came there. */
  constructor(go: (cycle: number) => Promise<boolean>) {
    this.#go = go;
  }

  /** The cycle to which it is on its way, if it is. */
  get goal(): number | null {
    return this.#way === null ? null : (this.#wish ?? this.#going);
  }

  /** Goes to a cycle, after the one that is on its way. Tells whether the last wish came true. */
  to(cycle: number): Promise<boolean> {
    this.#wish = cycle;
    this.#isSought = true;
    this.#way ??= this.#goOn();
    return this.#way;
  }

  /** Notes that the server starts anew: its next frame follows from none before. */
  jumped(): void {
    this.#isSought = true;
  }

  /** Notes a frame that has come; returns whether it was sought, and does not just follow the one before. */
  arrived(): boolean {
    const isSought = this.#isSought;
    // The one that comes after the answer is the last of a way.
    if (this.#way === null) this.#isSought = false;
    return isSought;
  }

  async #goOn(): Promise<boolean> {
    let isThere = false;
    while (this.#wish !== null) {
      const cycle = this.#wish;
      this.#wish = null;
      this.#going = cycle;
      isThere = await this.#go(cycle);
    }
    this.#way = null;
    return isThere;
  }
}
