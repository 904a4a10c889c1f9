/** All open sessions, the connection that they share, and what the page as a whole shows. */

import { Connection, Refused, problemOf, type Listener, type Surroundings } from "../connection";
import { HEADER_BYTES } from "../decode";
import { VERSION, type Notice, type Problem, type Subject } from "../protocol";
import { remember } from "./recents";
import { Session } from "./session.svelte";

/** Sessions side by side at most. */
export const MOST_SESSIONS = 4;

export interface Banner {
  words: string;
  isBad: boolean;
}

type Hello = Extract<Notice, { notice: "hello" }>;

export class Studio {
  hello = $state.raw<Hello | null>(null);
  isConnected = $state(false);
  banner = $state.raw<Banner | null>(null);
  problems = $state.raw<{ key: number; problem: Problem }[]>([]);
  sessions = $state.raw<Session[]>([]);
  activeKey = $state(0);
  /** All sessions beside each other, or the active one only. */
  sideBySide = $state(false);
  /** Transport commands go to all sessions. */
  inStep = $state(false);
  readonly #connection: Connection;
  #problemKeys = 0;

  constructor(surroundings: Surroundings) {
    const listener: Listener = {
      notice: (notice) => this.#notice(notice),
      frame: (bytes) => this.#frame(bytes),
      lost: (attempt, wait_ms) => this.#lost(attempt, wait_ms),
    };
    this.#connection = new Connection(listener, surroundings);
  }

  get active(): Session | null {
    return this.sessions.find((session) => session.key === this.activeKey) ?? null;
  }

  /** The sessions that a transport command is meant for. */
  get led(): Session[] {
    if (this.inStep) return this.sessions;
    return this.active ? [this.active] : [];
  }

  /** The sessions that are to be seen. */
  get visible(): Session[] {
    if (this.sideBySide) return this.sessions;
    return this.active ? [this.active] : [];
  }

  connect(): void {
    this.#connection.connect();
  }

  readonly ask: Connection["ask"] = (call) => this.#connection.ask(call);

  problem(problem: Problem): void {
    const same = this.problems.some(({ problem: p }) => p.place === problem.place && p.cause === problem.cause);
    if (same) return;
    this.problems = [...this.problems.slice(-3), { key: ++this.#problemKeys, problem }];
  }

  dismiss(key: number): void {
    this.problems = this.problems.filter((one) => one.key !== key);
  }

  /** Opens a subject in a new session and shows it. Returns whether that worked. */
  async open(subject: Subject, seed: number | null = null): Promise<boolean> {
    if (this.sessions.length >= MOST_SESSIONS) {
      this.problem(problemOf("sessions", `${MOST_SESSIONS} sessions are open, which is the most`, "close one first"));
      return false;
    }
    const session = new Session(subject, { ask: this.ask, problem: (problem) => this.problem(problem) });
    if (!(await this.#openAt(session, seed))) return false;
    remember(subject, session.scene.name);
    this.sessions = [...this.sessions, session];
    this.activeKey = session.key;
    this.#deliver(session);
    return true;
  }

  async #openAt(session: Session, seed: number | null): Promise<boolean> {
    try {
      const answer = await this.ask({ do: "open", what: session.subject, seed });
      if (answer.is !== "opened") return false;
      session.opened(answer);
      return true;
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      this.problem(error.problem);
      return false;
    }
  }

  // Transport, of all sessions or of the active one.

  play(): void {
    for (const session of this.led) session.play();
  }

  pause(): void {
    for (const session of this.led) session.pause();
  }

  step(cycles: number): void {
    for (const session of this.led) session.step(cycles);
  }

  seek(cycle: number): void {
    for (const session of this.led) session.seek(cycle);
  }

  close(session: Session): void {
    session.quietly({ do: "close" });
    const at = this.sessions.indexOf(session);
    this.sessions = this.sessions.filter((one) => one !== session);
    if (this.activeKey === session.key) this.activeKey = this.sessions[Math.max(0, at - 1)]?.key ?? 0;
    if (this.sessions.length < 2) this.sideBySide = this.inStep = false;
  }

  #byId(id: number): Session | undefined {
    return this.sessions.find((session) => session.id === id);
  }

  /** Notices and frames of a session may come before the page knows its number. */
  readonly #early = new Map<number, (Notice | ArrayBuffer)[]>();

  #notice(notice: Notice): void {
    if (notice.notice === "hello") return void this.#greeted(notice);
    const session = this.#byId(notice.session);
    if (!session) return this.#keep(notice.session, notice);
    if (notice.notice === "cast") session.takeCast(notice);
    else if (notice.notice === "status") session.takeStatus(notice);
    else session.takeEnd(notice.problem);
  }

  #frame(bytes: ArrayBuffer): void {
    if (bytes.byteLength < HEADER_BYTES) return;
    const id = new DataView(bytes).getUint32(8, true);
    const session = this.#byId(id);
    if (session) session.takeFrame(bytes);
    else this.#keep(id, bytes);
  }

  #keep(id: number, what: Notice | ArrayBuffer): void {
    if (this.#early.size > 8) this.#early.clear();
    const kept = this.#early.get(id) ?? [];
    this.#early.set(id, [...kept.slice(-8), what]);
  }

  /** Hands over what came before the page knew the session. */
  #deliver(session: Session): void {
    const kept = this.#early.get(session.id) ?? [];
    this.#early.delete(session.id);
    for (const what of kept) {
      if (what instanceof ArrayBuffer) this.#frame(what);
      else this.#notice(what);
    }
  }

  async #greeted(hello: Hello): Promise<void> {
    if (hello.version !== VERSION) {
      const words = `The server speaks version ${hello.version} of the protocol, this page ${VERSION}: reload the page.`;
      this.banner = { words, isBad: true };
      return;
    }
    const isFirst = this.hello === null;
    this.hello = hello;
    this.isConnected = true;
    this.banner = null;
    if (this.sessions.length > 0) await this.#reopen();
    else if (isFirst) for (const subject of hello.open) await this.open(subject as Subject);
  }

  #lost(attempt: number, wait_ms: number): void {
    this.isConnected = false;
    this.#early.clear();
    // Numbers of sessions are the server's, and a new one begins to count again.
    for (const session of this.sessions) session.id = 0;
    const wait = wait_ms < 1000 ? "at once" : `in ${Math.round(wait_ms / 1000)} s`;
    const words = `The server does not answer. Attempt ${attempt} to connect again comes ${wait}.`;
    this.banner = { words, isBad: true };
  }

  /** Opens all sessions again and brings each to the cycle where it was. */
  async #reopen(): Promise<void> {
    const told: string[] = [];
    for (const session of this.sessions) {
      const { cycle } = session.shown;
      const seed = session.seed;
      if (!(await this.#openAt(session, seed))) {
        session.takeEnd(problemOf(session.scene.name, "it could not be opened again", "open it anew, or close it"));
        continue;
      }
      this.#deliver(session);
      if (session.text !== null) await session.restart(seed, session.text);
      if (cycle > 0) await session.tell({ do: "seek", cycle });
      told.push(`${session.scene.name} at cycle ${cycle}`);
    }
    const words = told.length > 0 ? `Connected again; reopened ${told.join(", ")}.` : "Connected again.";
    this.banner = { words, isBad: false };
  }
}
