/** The time between requests that are dear to the server: it spends no more than a tenth of its time on them. */

const MIN_PAUSE_PER_REPLY = 10;

export class Pace {
  #dueAt_ms = 0;

  /** Returns whether enough time has gone by since the last reply. */
  get isDue(): boolean {
    return performance.now() >= this.#dueAt_ms;
  }

  /** Allows a request at once. */
  reset(): void {
    this.#dueAt_ms = 0;
  }

  /** A request that was sent at a time has been answered. */
  onReply(sentAt_ms: number): void {
    const now_ms = performance.now();
    this.#dueAt_ms = now_ms + MIN_PAUSE_PER_REPLY * (now_ms - sentAt_ms);
  }
}
