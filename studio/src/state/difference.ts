/** The difference of two runs: the first cycle in which their states differ, and the bodies that differ then. */

import type { Frame } from "../decode";
import type { BodyId } from "../protocol";
import type { Bodies } from "./bodies";

/**
 * Returns the first cycle in which two runs differ, assuming that they differ from then on; `null` if the last cycle is
 * the same. Doubles its steps before it bisects, so that little is computed beyond that cycle.
 */
export async function firstDifference(
  last: number,
  differs: (cycle: number) => Promise<boolean>,
): Promise<number | null> {
  if (await differs(0)) return 0;
  let same = 0;
  let other = Math.min(1, last);
  while (other > same && !(await differs(other))) {
    same = other;
    other = Math.min(last, 2 * other);
  }
  if (other === same) return null;
  while (other - same > 1) {
    const middle = Math.floor((same + other) / 2);
    if (await differs(middle)) other = middle;
    else same = middle;
  }
  return other;
}

/** The shown frame of a run, with its bodies. */
export interface RunFrame {
  bodies: Bodies;
  frame: Frame;
}

/** A body that differs between two runs, and how. */
export interface BodyDifference {
  body: BodyId;
  words: string;
}

/** The bodies whose data differ between two frames; those that exist in only one run come last. */
export function bodyDifferences(a: RunFrame, b: RunFrame, lengthWords: (meters: number) => string): BodyDifference[] {
  const found: BodyDifference[] = [];
  const unmatched: BodyDifference[] = [];
  for (let i = 0; i < a.bodies.count; i++) {
    const body = a.bodies.bodyId(i);
    const k = b.bodies.find(body);
    const words =
      k === undefined ? "exists in only one of them" : describeDifference(a.frame, i, b.frame, k, lengthWords);
    if (words !== null) (k === undefined ? unmatched : found).push({ body, words });
  }
  for (let k = 0; k < b.bodies.count; k++) {
    const body = b.bodies.bodyId(k);
    if (a.bodies.find(body) === undefined) unmatched.push({ body, words: "exists in only one of them" });
  }
  return [...found, ...unmatched];
}

function describeDifference(
  a: Frame,
  i: number,
  b: Frame,
  k: number,
  lengthWords: (meters: number) => string,
): string | null {
  const d = a.dimensions;
  if (d !== b.dimensions) return "has another number of dimensions";
  let square = 0;
  for (let n = 0; n < d; n++) square += (a.positions_m[d * i + n]! - b.positions_m[d * k + n]!) ** 2;
  if (square > 0) return `is ${lengthWords(Math.sqrt(square))} apart`;
  const t = d === 2 ? 1 : 4;
  for (let n = 0; n < t; n++) if (a.orientations[t * i + n] !== b.orientations[t * k + n]) return "has another heading";
  return a.conditions[i] === b.conditions[k] ? null : "has another condition";
}
