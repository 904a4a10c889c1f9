/** Frames dropped while the session was watched. Frames of hidden sessions do not count. */

export class DroppedFrames {
  #before = 0;
  #unseen = 0;
  #wasWatched = false;

  /** Takes the number of frames that the server has left out so far; returns how many of them would have been shown. */
  count(leftOut: number, isWatched: boolean): number {
    if (!isWatched || !this.#wasWatched) this.#unseen += Math.max(0, leftOut - this.#before);
    this.#wasWatched = isWatched;
    this.#before = leftOut;
    return leftOut - this.#unseen;
  }

  /** Resets, as the server restarts its count. */
  reset(): void {
    this.#before = this.#unseen = 0;
    this.#wasWatched = false;
  }
}
