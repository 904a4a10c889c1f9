/** A page that keeps the requests to its sessions, which tests reply to by hand. */

import { RequestError } from "../../src/connection";
import type { Problem, ReplyBody, SessionMethod } from "../../src/protocol";
import type { SessionHost } from "../../src/state/session-client.svelte";

/** A request without a reply. */
interface PendingRequest {
  call: SessionMethod;
  resolve: (answer: ReplyBody) => void;
  reject: (error: RequestError) => void;
}

export class FakeHost implements SessionHost {
  readonly pending: PendingRequest[] = [];
  readonly problems: Problem[] = [];

  request(): Promise<ReplyBody> {
    return new Promise(() => undefined);
  }

  requestSession(_: number, call: SessionMethod): Promise<ReplyBody> {
    return new Promise((resolve, reject) => this.pending.push({ call, resolve, reject }));
  }

  onProblem(problem: Problem): void {
    this.problems.push(problem);
  }

  /** The requests of a kind, in their order. */
  calls(kind: SessionMethod["do"]): SessionMethod[] {
    return this.pending.map(({ call }) => call).filter((call) => call.do === kind);
  }

  /** Replies to the oldest request of a kind. */
  async reply(kind: SessionMethod["do"], answer: ReplyBody): Promise<void> {
    this.#take(kind).resolve(answer);
    await settled();
  }

  /** Refuses the oldest request of a kind. */
  async refuse(kind: SessionMethod["do"], problem: Problem): Promise<void> {
    this.#take(kind).reject(new RequestError(problem));
    await settled();
  }

  #take(kind: SessionMethod["do"]): PendingRequest {
    const index = this.pending.findIndex(({ call }) => call.do === kind);
    if (index < 0) throw new Error(`no pending request: ${kind}`);
    return this.pending.splice(index, 1)[0]!;
  }
}

/** Resolves once all promises that are resolved have called their continuations. */
export async function settled(): Promise<void> {
  for (let i = 0; i < 20; i++) await Promise.resolve();
}
