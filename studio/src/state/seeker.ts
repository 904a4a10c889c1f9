/** Seeks to requested cycles: one at a time; of further requests only the latest is kept. */

export class Seeker {
  #requested: number | null = null;
  #current: number | null = null;
  #seeking: Promise<boolean> | null = null;
  #isAfterSeek = false;
  readonly #seek: (cycle: number) => Promise<boolean>;

  /** `seek` asks the server, and returns whether it reached the cycle. */
  constructor(seek: (cycle: number) => Promise<boolean>) {
    this.#seek = seek;
  }

  /** The cycle of the seek in progress, if there is one. */
  get target(): number | null {
    return this.#seeking === null ? null : (this.#requested ?? this.#current);
  }

  /** Seeks to a cycle, after the seek in progress. Returns whether the last requested cycle was reached. */
  seekTo(cycle: number): Promise<boolean> {
    this.#requested = cycle;
    this.#isAfterSeek = true;
    this.#seeking ??= this.#run();
    return this.#seeking;
  }

  /** The server has restarted the run: its next frame follows no earlier one. */
  onRestart(): void {
    this.#isAfterSeek = true;
  }

  /** Registers a frame; returns whether it results from a seek and does not just follow the previous one. */
  onFrame(): boolean {
    const isAfterSeek = this.#isAfterSeek;
    // The frame after the reply is the last one of a seek.
    if (this.#seeking === null) this.#isAfterSeek = false;
    return isAfterSeek;
  }

  async #run(): Promise<boolean> {
    let isReached = false;
    while (this.#requested !== null) {
      const cycle = this.#requested;
      this.#requested = null;
      this.#current = cycle;
      isReached = await this.#seek(cycle);
    }
    this.#seeking = null;
    return isReached;
  }
}
