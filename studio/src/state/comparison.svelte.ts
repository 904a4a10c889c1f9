/** The search for the first difference between two synchronized runs. */

import { withUnit } from "../format";
import { bodyDifferences, firstDifference, type BodyDifference } from "./difference";
import type { RunState } from "./run-state.svelte";
import type { Session } from "./session.svelte";

/** Maximum number of listed bodies. */
const MAX_LISTED = 5;

/** Ends a search that was canceled, or that cannot continue. */
class ComparisonError extends Error {
  constructor(words = "The comparison was canceled.") {
    super(words);
  }
}

/** The error of a run that cannot be compared. */
function digestMissing({ scene, status }: RunState): ComparisonError {
  return new ComparisonError(
    `${scene.name} cannot be compared, as its states have no digests. ${status.banner ?? ""}`.trim(),
  );
}

export class Comparison {
  /** Text on its progress or result; empty before. */
  words = $state("");
  isRunning = $state(false);
  #round = 0;

  /** Finds the cycle, brings both runs there, and selects the first body that differs. */
  async find(a: Session, b: Session): Promise<void> {
    const round = ++this.#round;
    this.isRunning = true;
    const last = Math.min(a.run.lastCycle, b.run.lastCycle);
    const differs = async (cycle: number): Promise<boolean> => {
      if (round !== this.#round) throw new ComparisonError();
      this.words = `Comparing ${a.run.scene.name} and ${b.run.scene.name} at cycle ${cycle}…`;
      const [one, other] = await Promise.all([a.playback.digestAt(cycle), b.playback.digestAt(cycle)]);
      if (!one || !other) throw new ComparisonError();
      for (const [session, { digest }] of [
        [a, one],
        [b, other],
      ] as const)
        if (digest === null) throw digestMissing(session.run);
      return one.digest !== other.digest || one.cycle !== other.cycle;
    };
    try {
      const cycle = await firstDifference(last, differs);
      if (cycle !== null) await differs(cycle);
      this.words = cycle === null ? `No difference up to cycle ${last}.` : await this.#describe(a, b, cycle);
    } catch (error) {
      if (!(error instanceof ComparisonError)) throw error;
      if (round === this.#round) this.words = error.message;
    } finally {
      if (round === this.#round) this.isRunning = false;
    }
  }

  stop(): void {
    this.#round++;
    this.isRunning = false;
    this.words = "";
  }

  async #describe(a: Session, b: Session, cycle: number): Promise<string> {
    const [frameOfA, frameOfB] = await Promise.all([
      a.frames.waitForCycle(a.run.status.cycle),
      b.frames.waitForCycle(b.run.status.cycle),
    ]);
    const bodiesOfA = a.frames.bodies;
    const bodiesOfB = b.frames.bodies;
    const where = cycle === 0 ? "They differ from the start" : `They differ from cycle ${cycle} on`;
    if (!frameOfA || !frameOfB || !bodiesOfA || !bodiesOfB) return `${where}.`;
    const differences = bodyDifferences(
      { bodies: bodiesOfA, frame: frameOfA },
      { bodies: bodiesOfB, frame: frameOfB },
      (m) => withUnit(m, "m"),
    );
    if (differences.length === 0) return `${where}: in state that is not visible, such as memory or counters.`;
    select(differences, a, b);
    const listed = differences.slice(0, MAX_LISTED).map(({ body, words }) => {
      const owner = bodiesOfA.find(body) === undefined ? bodiesOfB : bodiesOfA;
      return `${owner.nameOf(body)} ${words}`;
    });
    const more = differences.length > MAX_LISTED ? `, and ${differences.length - MAX_LISTED} more` : "";
    return `${where}: ${listed.join(", ")}${more}.`;
  }
}

/** Selects the first agent that differs, in both. */
function select(differences: BodyDifference[], a: Session, b: Session): void {
  const agent = differences.find(({ body }) => a.frames.bodies?.isAgent(body));
  if (!agent) return;
  a.selection.select(agent.body);
  if (b.frames.bodies?.find(agent.body) !== undefined) b.selection.select(agent.body);
}
