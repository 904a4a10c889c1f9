/** The search for the first difference of two runs that go in step. */

import { withUnit } from "../format";
import { differing, firstDifference, type Differing } from "./difference";
import type { Session } from "./session.svelte";

/** Bodies that are named. */
const MOST_NAMED = 5;

/** Ends a search that is no longer wanted, or that cannot go on. */
class GivenUp extends Error {
  constructor(words = "The comparison was given up.") {
    super(words);
  }
}

/** The reason why a run cannot be compared. */
function noDigest({ scene, status }: Session): GivenUp {
  return new GivenUp(`${scene.name} cannot be compared, as its states have no digests. ${status.banner ?? ""}`.trim());
}

export class Comparison {
  /** Words on its progress or its finding; empty before. */
  words = $state("");
  isRunning = $state(false);
  #round = 0;

  /** Finds the cycle, brings both runs there, and selects the first body that differs. */
  async find(a: Session, b: Session): Promise<void> {
    const round = ++this.#round;
    this.isRunning = true;
    const last = Math.min(a.lastCycle, b.lastCycle);
    const differs = async (cycle: number): Promise<boolean> => {
      if (round !== this.#round) throw new GivenUp();
      this.words = `Comparing ${a.scene.name} and ${b.scene.name} at cycle ${cycle}…`;
      const [one, other] = await Promise.all([a.digestAt(cycle), b.digestAt(cycle)]);
      if (!one || !other) throw new GivenUp();
      for (const [session, { digest }] of [
        [a, one],
        [b, other],
      ] as const)
        if (digest === null) throw noDigest(session);
      return one.digest !== other.digest || one.cycle !== other.cycle;
    };
    try {
      const cycle = await firstDifference(last, differs);
      if (cycle !== null) await differs(cycle);
      this.words = cycle === null ? `No difference up to cycle ${last}.` : await this.#told(a, b, cycle);
    } catch (error) {
      if (!(error instanceof GivenUp)) throw error;
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

  async #told(a: Session, b: Session, cycle: number): Promise<string> {
    const [one, other] = await Promise.all([a.frameAt(a.status.cycle), b.frameAt(b.status.cycle)]);
    const where = cycle === 0 ? "They differ from the start" : `They differ from cycle ${cycle} on`;
    if (!one || !other || !a.bodies || !b.bodies) return `${where}.`;
    const found = differing({ bodies: a.bodies, frame: one }, { bodies: b.bodies, frame: other }, (m) =>
      withUnit(m, "m"),
    );
    if (found.length === 0) return `${where}: in what is not seen, such as memory or counters.`;
    select(found, a, b);
    const named = found
      .slice(0, MOST_NAMED)
      .map(({ who, words }) => `${(a.bodies!.find(who) === undefined ? b : a).bodies!.nameOf(who)} ${words}`);
    const more = found.length > MOST_NAMED ? `, and ${found.length - MOST_NAMED} more` : "";
    return `${where}: ${named.join(", ")}${more}.`;
  }
}

/** Selects the first agent that differs, in both. */
function select(found: Differing[], a: Session, b: Session): void {
  const agent = found.find(({ who }) => {
    const index = a.bodies?.find(who);
    return index !== undefined && a.bodies?.cast.is_agent[index];
  });
  if (!agent) return;
  a.select(agent.who);
  if (b.bodies?.find(agent.who) !== undefined) b.select(agent.who);
}
