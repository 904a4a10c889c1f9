/** Frames that were left out while the session was watched. Frames out of sight are no loss. */

export class Missed {
  #before = 0;
  #forgiven = 0;
  #wasWatched = false;

  /** Takes the number that the server has left out so far; returns how many of them would have been seen. */
  count(leftOut: number, isWatched: boolean): number {
    if (!isWatched || !this.#wasWatched) this.#forgiven += Math.max(0, leftOut - this.#before);
    this.#wasWatched = isWatched;
    this.#before = leftOut;
    return leftOut - this.#forgiven;
  }

  /** Begins anew, as the server counts anew. */
  reset(): void {
    this.#before = this.#forgiven = 0;
    this.#wasWatched = false;
  }
}
