/** Playing backwards: the server goes to earlier cycles, each the one that is due when the one before was shown. */

/** The least time between two steps: more pictures would not be seen. */
const STEP_MS = 33;
/** A run that plays as fast as it goes has gone back to its start after this time. */
const FASTEST_S = 15;

/** Cycles per second backwards: those of the speed; at the fastest, enough to reach the start in some seconds. */
export function cyclesBack_per_s(times: number | "fastest", cycle_s: number, from: number): number {
  return times === "fastest" ? Math.max(100 / cycle_s, from / FASTEST_S) : times / cycle_s;
}

export class Rewind {
  isOn = $state(false);
  #round = 0;

  /** Goes back from a cycle until it is stopped or at the start; `goTo` tells whether it came there. */
  async start(from: number, cycles_per_s: number, goTo: (cycle: number) => Promise<boolean>): Promise<void> {
    const round = ++this.#round;
    const started_ms = performance.now();
    this.isOn = true;
    for (let cycle = from; cycle > 0;) {
      const due = Math.max(0, Math.floor(from - ((performance.now() - started_ms) / 1000) * cycles_per_s));
      if (due < cycle) {
        if (!(await goTo(due))) break;
        cycle = due;
      }
      await new Promise((then) => setTimeout(then, STEP_MS));
      if (round !== this.#round) return;
    }
    if (round === this.#round) this.isOn = false;
  }

  stop(): void {
    this.#round++;
    this.isOn = false;
  }
}
