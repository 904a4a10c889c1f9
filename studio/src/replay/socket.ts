/** A socket without a server: answers the page's requests from the parts of a replay in one file. */

import { RequestError, makeProblem, type Socket } from "../connection";
import { VERSION } from "../protocol";
import type { ClientRequest, Problem, ReplayFile, ReplyBody, ServerMethod, ServerNotification } from "../protocol";
import type { Parts } from "./parts";
import { damage, ReplayPlayer, type Outbox } from "./player";
import { Recording } from "./recording";

export class ReplaySocket implements Socket, Outbox {
  binaryType = "arraybuffer";
  onopen: ((event: never) => void) | null = null;
  onclose: ((event: never) => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  readonly #parts: Parts;
  readonly #file: Promise<ReplayFile>;
  readonly #players = new Map<number, ReplayPlayer>();
  #sessions = 0;

  constructor(parts: Parts) {
    this.#parts = parts;
    this.#file = parts.json<ReplayFile>(0);
    void this.#start();
  }

  send(text: string): void {
    void this.#reply(JSON.parse(text) as ClientRequest);
  }

  close(): void {
    for (const player of this.#players.values()) player.close();
    this.#players.clear();
    this.onmessage = null;
  }

  notify(notice: ServerNotification): void {
    this.onmessage?.({ data: JSON.stringify(notice) });
  }

  frame(bytes: ArrayBuffer): void {
    this.onmessage?.({ data: bytes });
  }

  async #start(): Promise<void> {
    // A file that is not whole opens nothing, and says so.
    const empty = { version: VERSION, program: "", runs: [] };
    const { version, program, runs } = await this.#file.catch((error: unknown) => {
      this.onmessage?.({ data: JSON.stringify({ id: 0, problem: damage(error) }) });
      return empty;
    });
    this.onopen?.({} as never);
    const open = runs.map((_, index) => ({ kind: "recording", path: String(index) }));
    this.notify({ notice: "hello", version, program, worlds: [], read_only: true, open });
  }

  async #reply(request: ClientRequest): Promise<void> {
    let result: { answer: ReplyBody } | { problem: Problem };
    try {
      result = { answer: await this.#answer(request) };
    } catch (error) {
      result = { problem: error instanceof RequestError ? error.problem : damage(error) };
    }
    this.onmessage?.({ data: JSON.stringify({ id: request.id, ...result }) });
  }

  async #answer(request: ClientRequest): Promise<ReplyBody> {
    if (!("session" in request)) return this.#answerForAll(request.call);
    const player = this.#players.get(request.session);
    if (!player) throw new RequestError(makeProblem("session", "there is no such session", "reload the page"));
    return player.answer(request.call);
  }

  async #answerForAll(call: ServerMethod): Promise<ReplyBody> {
    const { runs } = await this.#file;
    const run = call.do === "open" && call.target.kind === "recording" ? runs[Number(call.target.path)] : undefined;
    if (!run) {
      throw new RequestError(makeProblem("replay", "the file has nothing else to open", "use the studio for it"));
    }
    const recording = new Recording(run, this.#parts);
    await recording.prepare();
    const player = new ReplayPlayer(++this.#sessions, recording, this);
    this.#players.set(this.#sessions, player);
    return player.opened();
  }
}
