/** Speeds and waiting times of all bodies, as far as the frames tell that the page has seen. */

/** Speeds are means over so many cycles: a body on a grid stands still in most of them. */
export const SPEED_WINDOW_CYCLES = 20;
/** Maximum number of frames in the window that are kept; where there are more, those between are left out. */
const MAX_KEPT_FRAMES = 24;
/** A longer gap than this, in cycles, tells nothing of the motion in between. */
const MAX_GAP_CYCLES = 200;
/** In a fast run, where frames are far apart, a gap may also exceed the last one by this factor. */
const MAX_GAP_GROWTH = 4;

/** The way of each body up to a cycle. */
interface KeptWay {
  cycle: number;
  way_m: Float32Array;
}

export class Motion {
  readonly #bodies: number;
  readonly #dimensions: 2 | 3;
  readonly #last: Float32Array;
  /** The cycle of the frame in which each body was first seen where it is. */
  readonly #arrived: Float64Array;
  readonly #way_m: Float32Array;
  #kept: KeptWay[] = [];
  #cycle = -Infinity;
  #first = 0;
  #stride = 0;

  constructor(bodies: number, dimensions: 2 | 3) {
    this.#bodies = bodies;
    this.#dimensions = dimensions;
    this.#last = new Float32Array(bodies * dimensions);
    this.#arrived = new Float64Array(bodies);
    this.#way_m = new Float32Array(bodies);
  }

  /** The cycle since which all motion is known. */
  get since(): number {
    return this.#first;
  }

  /** Takes the positions of a frame. After a long gap, or a seek, everything begins anew. */
  push(cycle: number, positions_m: Float32Array, isSought: boolean): void {
    const gap = cycle - this.#cycle;
    if (gap === 0) return;
    // A video seeks from frame to frame, so that a short gap is none; long strides are those of play alone.
    const maxGap = isSought ? MAX_GAP_CYCLES : Math.max(MAX_GAP_CYCLES, MAX_GAP_GROWTH * this.#stride);
    if (!(gap > 0 && gap <= maxGap)) return this.#restart(cycle, positions_m);
    this.#stride = gap;
    this.#cycle = cycle;
    const d = this.#dimensions;
    for (let body = 0; body < this.#bodies; body++) {
      let squares = 0;
      for (let k = body * d; k < body * d + d; k++) {
        const moved = positions_m[k]! - this.#last[k]!;
        squares += moved * moved;
      }
      if (squares === 0) continue;
      this.#way_m[body]! += Math.sqrt(squares);
      this.#arrived[body] = cycle;
    }
    this.#last.set(positions_m.subarray(0, this.#last.length));
    this.#keep();
  }

  /** Cycles since each body was seen to move; at least so many, where it has not moved since all motion is known. */
  waiting(): Float32Array {
    return Float32Array.from(this.#arrived, (arrived) => this.#cycle - arrived);
  }

  /** The number of cycles over which speeds are means: more than usual where frames are far apart. */
  get window(): number {
    return Math.max(SPEED_WINDOW_CYCLES, this.#cycle - (this.#kept[0]?.cycle ?? this.#cycle));
  }

  /** The mean speed of each body over the last cycles, in meters per second; not a number where nothing is known. */
  speeds(cycle_s: number): Float32Array {
    const then = this.#kept[0];
    const time_s = then ? (this.#cycle - then.cycle) * cycle_s : 0;
    if (!then || time_s <= 0) return new Float32Array(this.#bodies).fill(NaN);
    return this.#way_m.map((way_m, body) => (way_m - then.way_m[body]!) / time_s);
  }

  #restart(cycle: number, positions_m: Float32Array): void {
    this.#first = this.#cycle = cycle;
    this.#stride = 0;
    this.#last.set(positions_m.subarray(0, this.#last.length));
    this.#arrived.fill(cycle);
    this.#way_m.fill(0);
    this.#kept = [{ cycle, way_m: this.#way_m.slice() }];
  }

  /** Keeps the ways of this frame, and drops those before the window; at least one stays. */
  #keep(): void {
    const kept = this.#kept;
    const newest = kept.at(-1)!;
    const isDue = this.#cycle - newest.cycle >= SPEED_WINDOW_CYCLES / (MAX_KEPT_FRAMES - 2);
    if (isDue) kept.push({ cycle: this.#cycle, way_m: this.#way_m.slice() });
    while (kept.length > 1 && this.#cycle - kept[1]!.cycle >= SPEED_WINDOW_CYCLES) kept.shift();
  }
}
