/** One socket to the server: requests with replies, notifications, frames, and reconnection. */

import { delayBefore_ms } from "./backoff";
import type { ReplyBody, Method, ServerNotification, Problem, Reply } from "./protocol";

/** The part of a WebSocket that a connection needs. */
export interface Socket {
  binaryType: string;
  onopen: ((event: never) => void) | null;
  onclose: ((event: never) => void) | null;
  onmessage: ((event: { data: unknown }) => void) | null;
  send(text: string): void;
  close(): void;
}

/** Callbacks for everything that arrives on a connection. */
export interface Listener {
  onNotification(notice: ServerNotification): void;
  onFrame(bytes: ArrayBuffer): void;
  /** Receives a problem that the server could not assign to a request. */
  onProblem(problem: Problem): void;
  /** Receives the loss of the socket; the next attempt starts after this time. */
  onLost(attempt: number, wait_ms: number): void;
}

/** A request that was refused, or whose connection was lost. */
export class RequestError extends Error {
  readonly problem: Problem;

  constructor(problem: Problem) {
    super(problem.cause);
    this.problem = problem;
  }
}

/** Creates a problem that the page itself has detected. */
export function makeProblem(place: string, cause: string, remedy: string): Problem {
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

/** A socket without the server's hello by then is abandoned: a proxy in between may hold it open. */
const HELLO_TIMEOUT_MS = 6000;

interface PendingRequest {
  resolve(answer: ReplyBody): void;
  reject(reason: RequestError): void;
}

/** The problem of requests whose connection was lost; one banner reports it for all of them. */
export const CONNECTION_LOST = makeProblem(
  "connection",
  "the connection to the server was lost",
  "the page reconnects automatically",
);

/** Clock and sockets, which tests replace. */
export interface Environment {
  open(): Socket;
  after(ms: number, then: () => void): unknown;
  cancel(timer: unknown): void;
}

export class Connection {
  #socket: Socket | null = null;
  #isReady = false;
  #nextId = 1;
  #attempt = 0;
  #timer: unknown = null;
  readonly #pending = new Map<number, PendingRequest>();
  readonly #listener: Listener;
  readonly #environment: Environment;

  constructor(listener: Listener, surroundings: Environment) {
    this.#listener = listener;
    this.#environment = surroundings;
  }

  /** Returns whether requests can be sent. */
  get isReady(): boolean {
    return this.#isReady;
  }

  /** Connects now, also if an attempt was planned for later. */
  connect(): void {
    this.#environment.cancel(this.#timer);
    this.#drop();
    const socket = this.#environment.open();
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => (this.#isReady = true);
    socket.onmessage = ({ data }) => this.#onMessage(data);
    socket.onclose = () => this.#onClose(socket);
    this.#timer = this.#environment.after(HELLO_TIMEOUT_MS, () => this.#onClose(socket));
  }

  /** Sends a call; the promise fails with `Refused`. */
  request(call: Method): Promise<ReplyBody> {
    if (!this.#socket || !this.#isReady) return Promise.reject(new RequestError(CONNECTION_LOST));
    const id = this.#nextId++;
    const answer = new Promise<ReplyBody>((resolve, reject) => this.#pending.set(id, { resolve, reject }));
    this.#socket.send(JSON.stringify({ id, call }));
    return answer;
  }

  /** The server has said hello: the next delay starts small again. */
  #onHello(): void {
    this.#environment.cancel(this.#timer);
    this.#attempt = 0;
  }

  #onMessage(data: unknown): void {
    if (data instanceof ArrayBuffer) return this.#listener.onFrame(data);
    const words = JSON.parse(String(data)) as Reply | ServerNotification;
    if ("notice" in words) {
      if (words.notice === "hello") this.#onHello();
      return this.#listener.onNotification(words);
    }
    if (words.id === 0 && "problem" in words) return this.#listener.onProblem(words.problem);
    const waiting = this.#pending.get(words.id);
    this.#pending.delete(words.id);
    if ("answer" in words) waiting?.resolve(words.answer);
    else waiting?.reject(new RequestError(words.problem));
  }

  #onClose(socket: Socket): void {
    if (socket !== this.#socket) return;
    this.#drop();
    const wait_ms = delayBefore_ms(this.#attempt++);
    this.#timer = this.#environment.after(wait_ms, () => this.connect());
    this.#listener.onLost(this.#attempt, wait_ms);
  }

  #drop(): void {
    const socket = this.#socket;
    this.#socket = null;
    this.#isReady = false;
    if (socket) {
      socket.onopen = socket.onclose = socket.onmessage = null;
      socket.close();
    }
    const waiting = [...this.#pending.values()];
    this.#pending.clear();
    for (const one of waiting) one.reject(new RequestError(CONNECTION_LOST));
  }
}
