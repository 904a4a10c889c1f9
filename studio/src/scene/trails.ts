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
  /** For each body, whether it lacks positions before the last frame, which have to be asked for. */
  readonly #lacks: Uint8Array;
  /** For each body, whether its ring has dropped positions. */
  readonly #hasDropped: Uint8Array;
  /** The number of the last gap, and the cycle up to which positions fill it. */
  #gap = 0;
  #gapCycle = 0;

  constructor(bodies: number, dimensions: 2 | 3) {
    this.bodies = bodies;
    this.dimensions = dimensions;
    this.length = Math.max(8, Math.min(MAX_POINTS_PER_BODY, Math.floor(MAX_POINTS / Math.max(1, bodies))));
    this.#places = new Float32Array(bodies * this.length * dimensions);
    this.#cycles = new Float64Array(bodies * this.length);
    this.#begins = new Int32Array(bodies);
    this.#counts = new Int32Array(bodies);
    this.#lacks = new Uint8Array(bodies);
    this.#hasDropped = new Uint8Array(bodies);
  }

  /** Returns whether some of these bodies lack positions before the last frame. */
  hasGap(bodies: Iterable<number>): boolean {
    for (const body of bodies) if (this.#lacks[body]) return true;
    return false;
  }

  /** Counts gaps: what was asked for an earlier one does not fill this one. */
  get gapNumber(): number {
    return this.#gap;
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
    if (gap > maxGap || (isSought && gap > 1)) this.#openGap(cycle);
    else if (gap < 0 && isSought) this.#openCut(cycle);
    if (!isSought && Number.isFinite(gap)) this.#stride = Math.max(gap, this.#stride / 2);
    this.#last = cycle;
    for (let body = 0; body < this.bodies; body++) this.#push(body, cycle, places);
  }

  clear(): void {
    this.#begins.fill(0);
    this.#counts.fill(0);
    this.#hasDropped.fill(0);
  }

  /** All bodies lack positions before a cycle, unless it is the first one. */
  #openGap(cycle: number): void {
    this.#gap++;
    this.#gapCycle = cycle;
    this.#lacks.fill(cycle > 0 ? 1 : 0);
  }

  /** After a seek back, bodies lack positions whose rings have dropped those before, and are half empty now. */
  #openCut(cycle: number): void {
    this.#gap++;
    this.#gapCycle = cycle;
    if (cycle === 0) return void this.#lacks.fill(0);
    for (let body = 0; body < this.bodies; body++)
      if (this.#hasDropped[body] && this.#counts[body]! < 0.5 * this.length) this.#lacks[body] = 1;
  }

  /** Takes over the trails of bodies that were there before under other numbers; `indexOf` returns the new ones. */
  adopt(before: Trails, indexOf: (body: number) => number | undefined): void {
    this.#last = before.#last;
    this.#stride = before.#stride;
    this.#gap = before.#gap;
    this.#gapCycle = before.#gapCycle;
    for (let body = 0; body < before.bodies; body++) {
      const to = indexOf(body);
      if (to === undefined) continue;
      this.#lacks[to] = before.#lacks[body]!;
      this.#hasDropped[to] = before.#hasDropped[body]!;
      const points = before.points(body);
      const cycles = before.#cyclesOf(body);
      for (let i = Math.max(0, points.length - this.length); i < points.length; i++)
        this.#append(to, cycles[i]!, points[i]!, 0);
    }
  }

  /**
   * Replaces the trails of some bodies up to a cycle, and keeps what was displayed since. `bodies` are those that were
   * asked for, of which the others have no trail.
   */
  load(
    trails: readonly BodyTrail[],
    until: number,
    bodies: Iterable<number>,
    indexOf: (trail: BodyTrail) => number | undefined,
  ): void {
    if (until >= this.#gapCycle) for (const body of bodies) this.#lacks[body] = 0;
    for (const trail of trails) {
      const body = indexOf(trail);
      if (body === undefined) continue;
      const points = this.points(body);
      const cycles = this.#cyclesOf(body);
      const known = trail.cycles.findLastIndex((cycle) => cycle <= until);
      this.#begins[body] = this.#counts[body] = 0;
      // It may begin later than the body: nobody knows what is before its first position.
      this.#hasDropped[body] = trail.cycles[0]! > 0 ? 1 : 0;
      for (let i = Math.max(0, known + 1 - this.length); i <= known; i++)
        this.#append(body, trail.cycles[i]!, trail.points_m, 3 * i);
      const last = trail.cycles[known] ?? -Infinity;
      for (let i = 0; i < points.length; i++) if (cycles[i]! > last) this.#append(body, cycles[i]!, points[i]!, 0);
    }
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
      this.#hasDropped[body] = 1;
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
