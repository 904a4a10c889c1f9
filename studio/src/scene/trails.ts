/** Trails of bodies: a ring of past places for each, kept by the page. */

/** Places that are kept of all bodies together, and of one. */
const MOST_PLACES = 240_000;
const MOST_OF_ONE = 600;
/** A jump of more cycles than this is no way that was seen. */
const GAP_CYCLES = 200;
/** Unless the run goes so fast that frames are far from each other: then it may be so much more than the last one. */
const GAP_GROWTH = 4;

export class Trails {
  readonly dimensions: 2 | 3;
  readonly bodies: number;
  /** Places that fit into each ring. */
  readonly length: number;
  readonly #places: Float32Array;
  readonly #cycles: Float64Array;
  readonly #begins: Int32Array;
  readonly #counts: Int32Array;
  #last = -Infinity;
  /** The distance of frames, in cycles; shrinks slowly, because a run that is paused ends on a shorter one. */
  #stride = 0;

  constructor(bodies: number, dimensions: 2 | 3) {
    this.bodies = bodies;
    this.dimensions = dimensions;
    this.length = Math.max(8, Math.min(MOST_OF_ONE, Math.floor(MOST_PLACES / Math.max(1, bodies))));
    this.#places = new Float32Array(bodies * this.length * dimensions);
    this.#cycles = new Float64Array(bodies * this.length);
    this.#begins = new Int32Array(bodies);
    this.#counts = new Int32Array(bodies);
  }

  /**
   * Takes the places of a frame. Going back shortens trails; a jump forward begins new ones, if it was sought or is much
   * wider than the last one: a run that goes faster makes wider ones, too.
   */
  push(cycle: number, places: Float32Array, isSought = false): void {
    const gap = cycle - this.#last;
    const widest = isSought ? GAP_CYCLES : Math.max(GAP_CYCLES, GAP_GROWTH * this.#stride);
    if (gap < 0) this.#cut(cycle);
    else if (gap > widest) this.clear();
    if (!isSought && Number.isFinite(gap)) this.#stride = Math.max(gap, this.#stride / 2);
    this.#last = cycle;
    for (let body = 0; body < this.bodies; body++) this.#push(body, cycle, places);
  }

  clear(): void {
    this.#begins.fill(0);
    this.#counts.fill(0);
  }

  #push(body: number, cycle: number, places: Float32Array): void {
    const d = this.dimensions;
    const count = this.#counts[body]!;
    const first = body * this.length;
    const newest = first + ((this.#begins[body]! + count - 1 + this.length) % this.length);
    const from = body * d;
    if (count > 0 && this.#isAt(newest, from, places)) return;
    let slot: number;
    if (count < this.length) {
      slot = first + ((this.#begins[body]! + count) % this.length);
      this.#counts[body] = count + 1;
    } else {
      slot = first + this.#begins[body]!;
      this.#begins[body] = (this.#begins[body]! + 1) % this.length;
    }
    for (let k = 0; k < d; k++) this.#places[slot * d + k] = places[from + k]!;
    this.#cycles[slot] = cycle;
  }

  #isAt(slot: number, from: number, places: Float32Array): boolean {
    const d = this.dimensions;
    for (let k = 0; k < d; k++) if (this.#places[slot * d + k] !== places[from + k]) return false;
    return true;
  }

  #cut(cycle: number): void {
    for (let body = 0; body < this.bodies; body++) {
      const first = body * this.length;
      let count = this.#counts[body]!;
      while (count > 0 && this.#cycles[first + ((this.#begins[body]! + count - 1) % this.length)]! > cycle) count--;
      this.#counts[body] = count;
    }
  }

  /** The places of a body, from the oldest to the newest, as columns of x y (z). */
  of(body: number): number[][] {
    const d = this.dimensions;
    const first = body * this.length;
    const way: number[][] = [];
    for (let i = 0; i < this.#counts[body]!; i++) {
      const slot = first + ((this.#begins[body]! + i) % this.length);
      way.push(Array.from(this.#places.subarray(slot * d, slot * d + d)));
    }
    return way;
  }
}
