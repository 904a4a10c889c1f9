/** Requests of one session to the server, and the reports of those that failed. */

import { CONNECTION_LOST, RequestError, makeProblem } from "../connection";
import type { Problem, ReplyBody, ServerMethod, SessionMethod } from "../protocol";

/** What a session needs from the page: requests and a sink of problems. */
export interface SessionHost {
  request(call: ServerMethod): Promise<ReplyBody>;
  requestSession(session: number, call: SessionMethod): Promise<ReplyBody>;
  onProblem(problem: Problem): void;
  /** A problem that was reported no longer holds, because what it was about has succeeded. */
  onMended?(problem: Problem): void;
  /** Whether the page is a replay in one file: it has no server, and runs are only shown. */
  readonly isReplay?: boolean;
}

const SESSION_NOT_OPEN = makeProblem("session", "it is not open on the server", "wait until the page has reconnected");

export class SessionClient {
  /** The server's number of the session; 0 between two connections, as each server assigns numbers anew. */
  id = $state(0);
  /** The problem that ended the session on the server. */
  ended = $state.raw<Problem | null>(null);
  readonly #host: SessionHost;
  /** The last problem of each method, until a request of it succeeds. */
  readonly #unmended = new Map<string, Problem>();

  constructor(host: SessionHost) {
    this.#host = host;
  }

  /** Returns whether the server has this session and can still serve it. */
  get isLive(): boolean {
    return this.id !== 0 && this.ended === null;
  }

  /** Returns whether the page is a replay in one file. */
  get isReplay(): boolean {
    return this.#host.isReplay ?? false;
  }

  /** Sends a request to the session. */
  request(call: SessionMethod): Promise<ReplyBody> {
    if (this.id === 0) return Promise.reject(new RequestError(SESSION_NOT_OPEN));
    return this.#host.requestSession(this.id, call);
  }

  /** Sends a request and reports its problem, if there is one. */
  async send(call: SessionMethod): Promise<ReplyBody | null> {
    try {
      const answer = await this.request(call);
      this.mend(call.do);
      return answer;
    } catch (error) {
      if (error instanceof RequestError) this.#unmended.set(call.do, error.problem);
      this.reportError(error);
      return null;
    }
  }

  /** Reports the problem of a method, until a request of it succeeds. */
  reportUntilMended(method: SessionMethod["do"], problem: Problem): void {
    this.#unmended.set(method, problem);
    this.reportProblem(problem);
  }

  /** A request of a method has succeeded: its last problem is shown no longer. */
  mend(method: SessionMethod["do"]): void {
    const problem = this.#unmended.get(method);
    this.#unmended.delete(method);
    if (problem) this.#host.onMended?.(problem);
  }

  /** Sends a request whose failure is ignored. */
  sendQuietly(call: SessionMethod): void {
    this.request(call).catch(() => undefined);
  }

  /** The scenario's text and file. */
  source(): Promise<ReplyBody> {
    return this.request({ do: "source" });
  }

  /** The JSON Schema of the scenarios of a world. */
  schema(world: string): Promise<ReplyBody> {
    return this.#host.request({ do: "schema", world });
  }

  /** The problems of a text, with the session's folder as that of relative paths. */
  check(text: string): Promise<ReplyBody> {
    return this.request({ do: "check", text });
  }

  /** The names of the recorded tables. */
  async tables(): Promise<string[]> {
    const answer = await this.send({ do: "tables" });
    return answer?.is === "tables" ? answer.names : [];
  }

  reportProblem(problem: Problem): void {
    this.#host.onProblem(problem);
  }

  /** Reports the problem of a failed request, except for a lost connection, which one banner reports for all. */
  reportError(error: unknown): void {
    if (!(error instanceof RequestError)) throw error;
    if (error.problem !== CONNECTION_LOST && error.problem !== SESSION_NOT_OPEN) this.reportProblem(error.problem);
  }
}
