/** Credit for frames: the server sends none without it. */

/** Maximum number of frames in flight. */
export const MAX_IN_FLIGHT = 2;

/** Counts granted and received frames; grants again those that were drawn or skipped. */
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

  /** Counts a received frame. */
  onFrame(): void {
    this.#granted = Math.max(0, this.#granted - 1);
  }

  /** Refills once the newest frame is drawn (or the session starts), so that skipped frames are granted again. */
  refill(): void {
    const frames = MAX_IN_FLIGHT - this.#granted;
    if (frames <= 0) return;
    this.#granted += frames;
    this.#grant(frames);
  }

  /** Resets together with the session on the server, where no credit is left. */
  reset(): void {
    this.#granted = 0;
  }
}
