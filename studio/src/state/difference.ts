/** The difference of two runs: the first cycle in which their states differ, and the bodies that differ then. */

import type { Frame } from "../decode";
import type { Who } from "../protocol";
import type { Bodies } from "./cast";

/**
 * Returns the first cycle in which two runs differ, if those that have parted stay apart; `null` where the last cycle is
 * the same. Goes ahead in steps that double before it halves them, so that little is computed beyond the cycle.
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

/** One run as it is shown. */
export interface Shown {
  bodies: Bodies;
  frame: Frame;
}

/** A body that is not alike in both, and how. */
export interface Differing {
  who: Who;
  words: string;
}

/** The bodies whose data in the frames differ; those that only one run has come last. */
export function differing(a: Shown, b: Shown, lengthWords: (meters: number) => string): Differing[] {
  const found: Differing[] = [];
  const lonely: Differing[] = [];
  for (let i = 0; i < a.bodies.count; i++) {
    const who = a.bodies.who(i);
    const k = b.bodies.find(who);
    const words = k === undefined ? "is in one of them only" : comparison(a.frame, i, b.frame, k, lengthWords);
    if (words !== null) (k === undefined ? lonely : found).push({ who, words });
  }
  for (let k = 0; k < b.bodies.count; k++) {
    const who = b.bodies.who(k);
    if (a.bodies.find(who) === undefined) lonely.push({ who, words: "is in one of them only" });
  }
  return [...found, ...lonely];
}

function comparison(a: Frame, i: number, b: Frame, k: number, lengthWords: (meters: number) => string): string | null {
  const d = a.dimensions;
  if (d !== b.dimensions) return "moves in another space";
  let square = 0;
  for (let n = 0; n < d; n++) square += (a.places_m[d * i + n]! - b.places_m[d * k + n]!) ** 2;
  if (square > 0) return `is ${lengthWords(Math.sqrt(square))} away`;
  const t = d === 2 ? 1 : 4;
  for (let n = 0; n < t; n++) if (a.turns[t * i + n] !== b.turns[t * k + n]) return "heads elsewhere";
  return a.conditions[i] === b.conditions[k] ? null : "is in another condition";
}
