/** Credit for frames: the server sends none without. */

/** Frames that may be under way at once. */
export const MOST_UNDER_WAY = 2;

/** Counts frames that were granted and have come; grants again those that were drawn or passed over. */
export class Credit {
  #granted = 0;
  readonly #grant: (frames: number) => void;

  constructor(grant: (frames: number) => void) {
    this.#grant = grant;
  }

  /** Frames that the server may still send. */
  get outstanding(): number {
    return this.#granted;
  }

  /** Notes a frame that has come. */
  arrived(): void {
    this.#granted = Math.max(0, this.#granted - 1);
  }

  /** Fills up once the newest frame is drawn (or the session begins), so that no passed-over frame is lost. */
  drawn(): void {
    const frames = MOST_UNDER_WAY - this.#granted;
    if (frames <= 0) return;
    this.#granted += frames;
    this.#grant(frames);
  }

  /** Begins anew with the session at the server, which knows of no credit. */
  reset(): void {
    this.#granted = 0;
  }
}
