/** One socket to the server: requests with replies, notices, frames, and attempts to connect again. */

import { waitBefore_ms } from "./backoff";
import type { Answer, Call, Notice, Problem, Reply } from "./protocol";

/** The part of a WebSocket that a connection needs. */
export interface Socket {
  binaryType: string;
  onopen: ((event: never) => void) | null;
  onclose: ((event: never) => void) | null;
  onmessage: ((event: { data: unknown }) => void) | null;
  send(text: string): void;
  close(): void;
}

/** Callbacks for all that happens on a connection. */
export interface Listener {
  notice(notice: Notice): void;
  frame(bytes: ArrayBuffer): void;
  /** Takes a problem of which the server could not tell which call it answers. */
  problem(problem: Problem): void;
  /** Notes that the socket is gone; the next attempt comes after this time. */
  lost(attempt: number, wait_ms: number): void;
}

/** A call that was refused, or whose connection was lost. */
export class Refused extends Error {
  readonly problem: Problem;

  constructor(problem: Problem) {
    super(problem.cause);
    this.problem = problem;
  }
}

/** A problem that the page itself has noticed. */
export function problemOf(place: string, cause: string, remedy: string): Problem {
  return {
    place,
    line: null,
    column: null,
    end_line: null,
    end_column: null,
    key: null,
    cause,
    remedy,
    is_warning: false,
  };
}

/** A socket on which the server has not said hello by then is given up: a proxy in between may hold it open. */
const GREETING_MS = 6000;

interface Waiting {
  resolve(answer: Answer): void;
  reject(reason: Refused): void;
}

/** The problem of calls whose connection was lost; the banner tells it for all of them. */
export const LOST = problemOf(
  "connection",
  "the connection to the server was lost",
  "the page connects again by itself",
);

/** Clock and sockets, which tests replace. */
export interface Surroundings {
  open(): Socket;
  after(ms: number, then: () => void): unknown;
  cancel(timer: unknown): void;
}

export class Connection {
  #socket: Socket | null = null;
  #isReady = false;
  #next = 1;
  #attempt = 0;
  #timer: unknown = null;
  readonly #waiting = new Map<number, Waiting>();
  readonly #listener: Listener;
  readonly #surroundings: Surroundings;

  constructor(listener: Listener, surroundings: Surroundings) {
    this.#listener = listener;
    this.#surroundings = surroundings;
  }

  /** Returns whether requests can be sent. */
  get isReady(): boolean {
    return this.#isReady;
  }

  /** Connects now, also if an attempt was planned for later. */
  connect(): void {
    this.#surroundings.cancel(this.#timer);
    this.#drop();
    const socket = this.#surroundings.open();
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => (this.#isReady = true);
    socket.onmessage = ({ data }) => this.#heard(data);
    socket.onclose = () => this.#lost(socket);
    this.#timer = this.#surroundings.after(GREETING_MS, () => this.#lost(socket));
  }

  /** Sends a call; the promise fails with `Refused`. */
  ask(call: Call): Promise<Answer> {
    if (!this.#socket || !this.#isReady) return Promise.reject(new Refused(LOST));
    const id = this.#next++;
    const answer = new Promise<Answer>((resolve, reject) => this.#waiting.set(id, { resolve, reject }));
    this.#socket.send(JSON.stringify({ id, call }));
    return answer;
  }

  /** Notes that the other side has said hello: the next wait begins small again. */
  #greeted(): void {
    this.#surroundings.cancel(this.#timer);
    this.#attempt = 0;
  }

  #heard(data: unknown): void {
    if (data instanceof ArrayBuffer) return this.#listener.frame(data);
    const words = JSON.parse(String(data)) as Reply | Notice;
    if ("notice" in words) {
      if (words.notice === "hello") this.#greeted();
      return this.#listener.notice(words);
    }
    if (words.id === 0 && "problem" in words) return this.#listener.problem(words.problem);
    const waiting = this.#waiting.get(words.id);
    this.#waiting.delete(words.id);
    if ("answer" in words) waiting?.resolve(words.answer);
    else waiting?.reject(new Refused(words.problem));
  }

  #lost(socket: Socket): void {
    if (socket !== this.#socket) return;
    this.#drop();
    const wait_ms = waitBefore_ms(this.#attempt++);
    this.#timer = this.#surroundings.after(wait_ms, () => this.connect());
    this.#listener.lost(this.#attempt, wait_ms);
  }

  #drop(): void {
    const socket = this.#socket;
    this.#socket = null;
    this.#isReady = false;
    if (socket) {
      socket.onopen = socket.onclose = socket.onmessage = null;
      socket.close();
    }
    const waiting = [...this.#waiting.values()];
    this.#waiting.clear();
    for (const one of waiting) one.reject(new Refused(LOST));
  }
}
