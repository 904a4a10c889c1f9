/**
 * Seeks to requested cycles. A seek that lasts gives way to a newer request; of requests that come sooner only the latest
 * is kept, so that pictures come while somebody scrubs.
 */

/** Time after which a seek in progress is replaced by a newer one. */
export const REPLACED_AFTER_MS = 250;

export class Seeker {
  #requested: number | null = null;
  #current: number | null = null;
  #seeking: Promise<boolean> | null = null;
  #isAfterSeek = false;
  #startedAt_ms = 0;
  /** Goes on with the newest request without the reply to the one in progress. */
  #replace: () => void = () => undefined;
  readonly #seek: (cycle: number) => Promise<boolean>;

  /** `seek` asks the server, and returns whether it reached the cycle. */
  constructor(seek: (cycle: number) => Promise<boolean>) {
    this.#seek = seek;
  }

  /** The cycle of the seek in progress, if there is one. */
  get target(): number | null {
    return this.#seeking === null ? null : (this.#requested ?? this.#current);
  }

  /** Returns whether the seek to a cycle is the one in progress, which no newer one has replaced. */
  isCurrent(cycle: number): boolean {
    return this.#current === cycle;
  }

  /** Seeks to a cycle, instead of the seek in progress. Returns whether the last requested cycle was reached. */
  seekTo(cycle: number): Promise<boolean> {
    this.#requested = cycle;
    this.#isAfterSeek = true;
    if (this.#seeking === null) return (this.#seeking = this.#run());
    const replace = this.#replace;
    setTimeout(replace, Math.max(0, this.#startedAt_ms + REPLACED_AFTER_MS - performance.now()));
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
      this.#startedAt_ms = performance.now();
      const replaced = new Promise<boolean>((then) => (this.#replace = () => then(false)));
      isReached = await Promise.race([this.#seek(cycle), replaced]);
    }
    this.#current = null;
    this.#seeking = null;
    return isReached;
  }
}
