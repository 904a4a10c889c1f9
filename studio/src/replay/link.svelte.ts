/** The address of a replay holds the cycle and the selected agent: `#cycle=1234&agent=8`. */

import { untrack } from "svelte";
import type { BodyId } from "../protocol";
import type { Bodies } from "../state/bodies";
import type { Session } from "../state/session.svelte";
import type { Studio } from "../state/studio.svelte";

/** The address is written after it has stayed the same for so long: browsers bound how often a page may do so. */
const WRITE_DELAY_MS = 300;

/** What an address says; null where it says nothing. */
export interface Link {
  cycle: number | null;
  agent: string | null;
}

/** Reads the part of an address after `#`. */
export function parseLink(hash: string): Link {
  const fields = new URLSearchParams(hash.replace(/^#/, ""));
  const cycle = fields.get("cycle");
  return { cycle: cycle !== null && /^\d+$/.test(cycle) ? Number(cycle) : null, agent: fields.get("agent") };
}

/** Writes the part of an address after `#`. */
export function formatLink({ cycle, agent }: Link): string {
  const fields = [cycle === null ? "" : `cycle=${cycle}`, agent === null ? "" : `agent=${encodeAgent(agent)}`];
  return fields.filter((field) => field !== "").join("&");
}

/** A name in an address; slashes are readable there. */
function encodeAgent(agent: string): string {
  return encodeURIComponent(agent).replaceAll("%2F", "/");
}

/** The agent of a name: its own name, `8`, `8/17` with a part, or `robot/8` where another kind has the same number. */
export function findAgent(bodies: Bodies, name: string): BodyId | null {
  for (const index of bodies.agents) {
    const id = bodies.bodyId(index);
    if (namesOf(id).includes(name) || bodies.name(index) === name) return id;
  }
  return null;
}

/** The shortest name in an address that means this agent. */
export function agentName(bodies: Bodies, body: BodyId): string {
  const isIt = (name: string): boolean => {
    const found = findAgent(bodies, name);
    return found?.kind === body.kind && found.number === body.number && found.part === body.part;
  };
  const names = namesOf(body);
  return names.find(isIt) ?? names.at(-1)!;
}

function namesOf({ kind, number, part }: BodyId): string[] {
  const short = part === null ? `${number}` : `${number}/${part}`;
  return [short, `${kind}/${short}`];
}

/**
 * What an address asks for that is not done yet. Cycle and agent wait for something of their own: the cycle until all runs
 * are open, the agent until its body is known.
 */
export class LinkRequest {
  #link: Link;

  constructor(link: Link) {
    this.#link = link;
  }

  /** Takes the cycle to go to, once. */
  takeCycle(): number | null {
    const { cycle } = this.#link;
    this.#link = { ...this.#link, cycle: null };
    return cycle;
  }

  /** Takes the agent to select, once it is among the bodies. */
  takeAgent(bodies: Bodies): BodyId | null {
    const { agent } = this.#link;
    const body = agent === null ? null : findAgent(bodies, agent);
    if (body !== null) this.#link = { ...this.#link, agent: null };
    return body;
  }
}

/** Shows what the address says, also when it changes; and keeps it up to date while the replay rests. */
export function followLink(studio: Studio): void {
  let request = new LinkRequest(parseLink(location.hash));
  let timer: ReturnType<typeof setTimeout> | undefined;

  function go(): void {
    const cycle = request.takeCycle();
    if (cycle === null) return;
    // Of a file with two runs both, whether or not they go in step yet.
    for (const session of studio.sessions) session.playback.seek(cycle);
  }

  function selectAgent(session: Session, bodies: Bodies): void {
    const body = request.takeAgent(bodies);
    if (body !== null) session.selection.select(body);
  }

  function write(link: Link): void {
    clearTimeout(timer);
    timer = setTimeout(() => history.replaceState(null, "", `#${formatLink(link)}`), WRITE_DELAY_MS);
  }

  $effect.root(() => {
    $effect(() => {
      const isOpen = studio.hello !== null && studio.sessions.length === studio.hello.open.length;
      if (isOpen && studio.active) untrack(go);
    });
    $effect(() => {
      const session = studio.active;
      const bodies = session?.frames.bodies;
      if (!session || !bodies) return;
      untrack(() => selectAgent(session, bodies));
      if (session.playback.isMoving) return;
      const { body } = session.selection;
      write({ cycle: session.frames.displayed.cycle, agent: body && agentName(bodies, body) });
    });
  });
  addEventListener("hashchange", () => {
    request = new LinkRequest(parseLink(location.hash));
    const session = studio.active;
    if (!session) return;
    go();
    if (session.frames.bodies) selectAgent(session, session.frames.bodies);
  });
}
