/** Playing backwards: seeks to earlier cycles, each the one that is due once the previous one is shown. */

/** Minimum time between two steps: more frames would not be visible. */
const MIN_STEP_MS = 33;
/** At the fastest speed, a run is back at its start after this time. */
const FULL_REWIND_S = 15;

/** Cycles per second backwards: those of the speed; at the fastest, enough to reach the start in some seconds. */
export function cyclesBack_per_s(times: number | "fastest", cycle_s: number, from: number): number {
  return times === "fastest" ? Math.max(100 / cycle_s, from / FULL_REWIND_S) : times / cycle_s;
}

export class Rewind {
  isOn = $state(false);
  #round = 0;

  /** Goes back from a cycle until stopped or at the start; `seekTo` returns whether the cycle was reached. */
  async start(from: number, cycles_per_s: number, seekTo: (cycle: number) => Promise<boolean>): Promise<void> {
    const round = ++this.#round;
    const started_ms = performance.now();
    this.isOn = true;
    for (let cycle = from; cycle > 0;) {
      const due = Math.max(0, Math.floor(from - ((performance.now() - started_ms) / 1000) * cycles_per_s));
      if (due < cycle) {
        if (!(await seekTo(due))) break;
        cycle = due;
      }
      await new Promise((then) => setTimeout(then, MIN_STEP_MS));
      if (round !== this.#round) return;
    }
    if (round === this.#round) this.isOn = false;
  }

  stop(): void {
    this.#round++;
    this.isOn = false;
  }
}
