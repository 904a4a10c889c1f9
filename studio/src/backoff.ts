/** Delays between connection attempts. */

const INITIAL_MS = 250;
const MAX_MS = 8000;

/** The delay before an attempt, by its number (from 0): doubles up to 8 s. */
export function delayBefore_ms(attempt: number): number {
  return Math.min(MAX_MS, INITIAL_MS * 2 ** Math.min(attempt, 10));
}
