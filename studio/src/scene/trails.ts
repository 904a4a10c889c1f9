/** Trails of bodies: a ring buffer of past positions for each, kept by the page and completed by the server. */

import type { BodyTrail } from "../protocol";

/** Maximum number of stored points, of all bodies together and of one. */
const MAX_POINTS = 240_000;
const MAX_POINTS_PER_BODY = 600;
/** A longer gap than this, in cycles, breaks a trail: the motion in between is unknown. */
const MAX_GAP_CYCLES = 200;
/** In a fast run, where frames are far apart, a gap may also exceed the last one by this factor. */
const MAX_GAP_GROWTH = 4;

export class Trails {
  readonly dimensions: 2 | 3;
  readonly bodies: number;
  /** Capacity of each ring. */
  readonly length: number;
  readonly #places: Float32Array;
  readonly #cycles: Float64Array;
  readonly #begins: Int32Array;
  readonly #counts: Int32Array;
  #last = -Infinity;
  /** The interval of frames in cycles; shrinks slowly, because a pause ends on a shorter one. */
  #stride = 0;
  /** Whether positions before the last frame were never displayed, and have to be asked for. */
  #hasGap = false;

  constructor(bodies: number, dimensions: 2 | 3) {
    this.bodies = bodies;
    this.dimensions = dimensions;
    this.length = Math.max(8, Math.min(MAX_POINTS_PER_BODY, Math.floor(MAX_POINTS / Math.max(1, bodies))));
    this.#places = new Float32Array(bodies * this.length * dimensions);
    this.#cycles = new Float64Array(bodies * this.length);
    this.#begins = new Int32Array(bodies);
    this.#counts = new Int32Array(bodies);
  }

  /** Whether the trails lack positions before the last frame. */
  get hasGap(): boolean {
    return this.#hasGap;
  }

  /** The cycle of the last frame. */
  get lastCycle(): number {
    return this.#last;
  }

  /**
   * Adds the positions of a frame. Going back shortens trails; a jump forward clears them if it was a seek, or if it is
   * much wider than the last interval: a faster run makes wider intervals, too.
   */
  push(cycle: number, places: Float32Array, isSought = false): void {
    const gap = cycle - this.#last;
    const maxGap = isSought ? MAX_GAP_CYCLES : Math.max(MAX_GAP_CYCLES, MAX_GAP_GROWTH * this.#stride);
    if (gap < 0) this.#cut(cycle);
    else if (gap > maxGap) this.clear();
    // A seek skips positions, as does the first frame of a run that is not at its start.
    if (gap > maxGap || (isSought && gap > 1)) this.#hasGap = cycle > 0;
    if (!isSought && Number.isFinite(gap)) this.#stride = Math.max(gap, this.#stride / 2);
    this.#last = cycle;
    for (let body = 0; body < this.bodies; body++) this.#push(body, cycle, places);
  }

  clear(): void {
    this.#begins.fill(0);
    this.#counts.fill(0);
  }

  /** Takes over the trails of bodies that were there before under other numbers; `indexOf` returns the new ones. */
  adopt(before: Trails, indexOf: (body: number) => number | undefined): void {
    this.#last = before.#last;
    this.#stride = before.#stride;
    this.#hasGap = before.#hasGap;
    for (let body = 0; body < before.bodies; body++) {
      const to = indexOf(body);
      if (to === undefined) continue;
      const points = before.points(body);
      const cycles = before.#cyclesOf(body);
      for (let i = Math.max(0, points.length - this.length); i < points.length; i++)
        this.#append(to, cycles[i]!, points[i]!, 0);
    }
  }

  /** Replaces the trails of some bodies up to a cycle, and keeps what was displayed since. */
  load(trails: readonly BodyTrail[], until: number, indexOf: (trail: BodyTrail) => number | undefined): void {
    for (const trail of trails) {
      const body = indexOf(trail);
      if (body === undefined) continue;
      const points = this.points(body);
      const cycles = this.#cyclesOf(body);
      const known = trail.cycles.findLastIndex((cycle) => cycle <= until);
      this.#begins[body] = this.#counts[body] = 0;
      for (let i = Math.max(0, known + 1 - this.length); i <= known; i++)
        this.#append(body, trail.cycles[i]!, trail.points_m, 3 * i);
      const last = trail.cycles[known] ?? -Infinity;
      for (let i = 0; i < points.length; i++) if (cycles[i]! > last) this.#append(body, cycles[i]!, points[i]!, 0);
    }
    this.#hasGap = false;
  }

  #push(body: number, cycle: number, places: Float32Array): void {
    const d = this.dimensions;
    const count = this.#counts[body]!;
    const first = body * this.length;
    const newest = first + ((this.#begins[body]! + count - 1 + this.length) % this.length);
    const from = body * d;
    if (count > 0 && this.#isAt(newest, from, places)) return;
    this.#append(body, cycle, places, from);
  }

  /** Appends the place that begins at an index of a list. */
  #append(body: number, cycle: number, places: ArrayLike<number>, from: number): void {
    const d = this.dimensions;
    const count = this.#counts[body]!;
    const first = body * this.length;
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

  #cyclesOf(body: number): number[] {
    return this.#slots(body).map((slot) => this.#cycles[slot]!);
  }

  #slots(body: number): number[] {
    const first = body * this.length;
    return Array.from({ length: this.#counts[body]! }, (_, i) => first + ((this.#begins[body]! + i) % this.length));
  }

  /** The points of a body, from the oldest to the newest, as x y (z). */
  points(body: number): number[][] {
    const d = this.dimensions;
    return this.#slots(body).map((slot) => Array.from(this.#places.subarray(slot * d, slot * d + d)));
  }
}
