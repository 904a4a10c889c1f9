/** Waiting times between attempts to connect. */

const FIRST_MS = 250;
const MOST_MS = 8000;

/** The wait before the attempt of this number (from 0): doubles up to 8 s. */
export function waitBefore_ms(attempt: number): number {
  return Math.min(MOST_MS, FIRST_MS * 2 ** Math.min(attempt, 10));
}
