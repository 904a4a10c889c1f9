/** Plays a recording of a replay: does for one session what a session of the server does. */

import { RequestError, makeProblem } from "../connection";
import type {
  BodyId,
  FrameText,
  Problem,
  ReplyBody,
  ServerNotification,
  SessionMethod,
  SessionState,
  SessionStatus,
  Speed,
} from "../protocol";
import { cyclesBack_per_s } from "../state/rewind.svelte";
import { frameBytes } from "./chunk";
import type { Recording } from "./recording";

/** Time between two frames while it plays; a browser shows no more. */
const FRAME_INTERVAL_MS = 16;
/** Time between two reports of the status while it plays. */
const STATUS_INTERVAL_MS = 100;

/** Where messages to the page go. */
export interface Outbox {
  notify(notice: ServerNotification): void;
  frame(bytes: ArrayBuffer): void;
}

/** The refusal of a request. */
function refusal(place: string, cause: string, remedy: string): RequestError {
  return new RequestError(makeProblem(place, cause, remedy));
}

export class ReplayPlayer {
  readonly #id: number;
  readonly #recording: Recording;
  readonly #outbox: Outbox;
  #frame = 0;
  #state: SessionState = "paused";
  #speed: Speed;
  #credit = 0;
  /** Whether the last frame that was sent is out of date. */
  #isStale = true;
  #isSending = false;
  #scansOf: BodyId[] = [];
  #tableSent = 0;
  /** Counts commands: a seek that is not the last one has been replaced. */
  #commands = 0;
  /** Counts seeks that have arrived: a frame that was read before the last one is no longer sent. */
  #arrivals = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(id: number, recording: Recording, outbox: Outbox) {
    this.#id = id;
    this.#recording = recording;
    this.#outbox = outbox;
    this.#speed = recording.run.status.speed;
  }

  /** The reply to the request that opens it. */
  opened(): ReplyBody {
    return { is: "opened", session: this.#id, scene: this.#recording.run.scene, status: this.#status(0) };
  }

  close(): void {
    this.#commands++;
    clearTimeout(this.#timer);
    this.#credit = 0;
  }

  /** Answers a request; fails with a `RequestError`. */
  async answer(call: SessionMethod): Promise<ReplyBody> {
    switch (call.do) {
      case "play":
        this.#play(call.speed);
        break;
      case "pause":
        this.#pause();
        break;
      case "step":
        await this.#seek(this.#recording.frameFrom(this.#cycle + call.cycles));
        break;
      case "seek":
        await this.#seek(this.#recording.frameUntil(call.cycle));
        break;
      case "credit":
        this.#credit += call.frames;
        void this.#send();
        break;
      case "select-scans":
        this.#scansOf = call.bodies;
        this.#refresh();
        break;
      case "inspect":
        return this.#inspect(call.body);
      case "metrics":
        return this.#recording.metrics(call.from);
      case "agent-metrics":
        return this.#recording.agentMetrics(call.metric, this.#cycle);
      case "find-events":
        return this.#recording.findEvents(call);
      case "events":
        return this.#recording.events(call.from, call.until, call.skip ?? 0, call.limit);
      case "trails":
        return this.#recording.trails(call.until, call.bodies);
      case "source":
        return this.#recording.source();
      case "tables":
        return { is: "tables", names: [] };
      case "close":
        this.close();
        break;
      default:
        throw refusal("replay", "a replay in one file is only shown", "run its scenario in the studio");
    }
    return { is: "done" };
  }

  get #cycle(): number {
    return this.#recording.cycleOf(this.#frame);
  }

  get #isAtEnd(): boolean {
    return this.#frame === this.#recording.count - 1;
  }

  #status(cycles_per_s: number): SessionStatus {
    const { run } = this.#recording;
    const isPaused = this.#state === "paused" || this.#state === "over";
    const own = this.#state === "over" ? run.digest : null;
    const digest = isPaused ? (own ?? this.#recording.digestOf(this.#frame)) : null;
    const time_s = this.#cycle * run.scene.cycle_s;
    const { cycles_planned, seed, banner } = run.status;
    return {
      session: this.#id,
      state: this.#state,
      cycle: this.#cycle,
      cycles_planned,
      time_s,
      speed: this.#speed,
      cycles_per_s,
      seed,
      digest,
      banner,
      fleet: null,
    };
  }

  #report(cycles_per_s = 0): void {
    this.#outbox.notify({ notice: "status", ...this.#status(cycles_per_s) });
  }

  #refresh(): void {
    this.#isStale = true;
    void this.#send();
  }

  #pause(): void {
    this.#commands++;
    clearTimeout(this.#timer);
    this.#rest();
  }

  /** Rests at the present frame. */
  #rest(): void {
    this.#state = this.#isAtEnd ? "over" : "paused";
    this.#report();
    this.#refresh();
  }

  #play(speed: Speed): void {
    this.#pause();
    this.#speed = speed;
    if (this.#isAtEnd) return;
    this.#state = "playing";
    const { run } = this.#recording;
    const times = speed === "fastest" ? speed : speed.times;
    const rate = cyclesBack_per_s(times, run.scene.cycle_s, run.status.cycles_planned);
    this.#report(rate);
    const start = { cycle: this.#cycle, time_ms: performance.now() };
    let reported_ms = start.time_ms;
    const advance = (): void => {
      const now_ms = performance.now();
      const due = start.cycle + ((now_ms - start.time_ms) / 1000) * rate;
      this.#show(Math.max(this.#frame, this.#recording.frameUntil(due)));
      if (this.#isAtEnd) return this.#rest();
      if (now_ms - reported_ms >= STATUS_INTERVAL_MS) {
        reported_ms = now_ms;
        this.#report(rate);
      }
      this.#timer = setTimeout(advance, FRAME_INTERVAL_MS);
    };
    this.#timer = setTimeout(advance, FRAME_INTERVAL_MS);
  }

  async #seek(frame: number): Promise<void> {
    clearTimeout(this.#timer);
    const command = ++this.#commands;
    this.#state = "seeking";
    await this.#recording.columns(frame);
    if (command !== this.#commands) {
      throw refusal(`cycle ${this.#recording.cycleOf(frame)}`, "replaced by another request", "ask again to go there");
    }
    this.#arrivals++;
    this.#frame = frame;
    this.#state = this.#isAtEnd ? "over" : "paused";
    // The page learns the cycle before the reply, and gets the frame after it: it tells by the reply that the frame
    // follows no other. While somebody scrubs, the next seek comes before the frame, which is sent nevertheless.
    this.#report();
    setTimeout(() => this.#refresh(), 0);
  }

  #show(frame: number): void {
    if (frame === this.#frame) return;
    this.#frame = frame;
    this.#refresh();
  }

  /** Sends the present frame, if it has not been sent and there is credit for it; one at a time. */
  async #send(): Promise<void> {
    if (this.#isSending || !this.#isStale || this.#credit === 0) return;
    this.#isSending = true;
    this.#isStale = false;
    try {
      await this.#sendFrame(this.#frame);
    } catch (error) {
      this.#outbox.notify({ notice: "ended", session: this.#id, problem: damage(error) });
      return;
    } finally {
      this.#isSending = false;
    }
    void this.#send();
  }

  async #sendFrame(frame: number): Promise<void> {
    const arrivals = this.#arrivals;
    const columns = await this.#recording.columns(frame);
    const cycle = this.#recording.cycleOf(frame);
    const text = await this.#scansAt(cycle);
    const table = columns.table === this.#tableSent ? null : await this.#recording.table(columns.table);
    // After the reply to a seek, the page takes the next frame for the one that it has asked for.
    if (arrivals !== this.#arrivals || this.#credit === 0) return;
    if (table) {
      this.#tableSent = columns.table;
      this.#outbox.notify({ notice: "bodies", ...table, session: this.#id });
    }
    this.#credit--;
    const time_s = cycle * this.#recording.run.scene.cycle_s;
    this.#outbox.frame(frameBytes(columns, { session: this.#id, cycle, time_s, text }));
  }

  /** The scans of the selected bodies; null if the file has none. */
  async #scansAt(cycle: number): Promise<FrameText | null> {
    const found = await Promise.all(this.#scansOf.map((body) => this.#recording.inspection(body, cycle)));
    const scans = found.flatMap((one) => one?.scans ?? []);
    return scans.length > 0 ? { scans, events: [], events_left_out: 0 } : null;
  }

  async #inspect(body: BodyId): Promise<ReplyBody> {
    const cycle = this.#cycle;
    const found = await this.#recording.inspection(body, cycle);
    if (found) return { is: "inspection", ...found.inspection };
    const { inspected } = this.#recording.run;
    const part = body.part === null ? "" : `/${body.part}`;
    const cause = `this file does not hold what it perceived and decided in cycle ${cycle}`;
    const remedy =
      inspected === ""
        ? `an export with \`--agents ${body.number}${part}\` does`
        : `it holds that of ${inspected}; an export with other --agents and --cycles holds more`;
    throw refusal(`${body.kind} ${body.number}${part}`, cause, remedy);
  }
}

/** The problem of a file that cannot be read. */
export function damage(error: unknown): Problem {
  const cause = error instanceof Error ? error.message : String(error);
  return makeProblem("replay", `a part of the file cannot be read: ${cause}`, "get the file again");
}
