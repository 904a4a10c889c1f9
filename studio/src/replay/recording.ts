/** A recorded run of a replay: its frames by number, events, metrics and inspections, read when they are needed. */

import { bodyKey } from "../format";
import type {
  BodyId,
  BodyTable,
  ReplayEvents,
  ReplayInspection,
  ReplayRun,
  ReplaySpan,
  ReplayTablesPart,
  ReplyBody,
  RunEvent,
} from "../protocol";
import { RequestError, makeProblem } from "../connection";
import { namesByBody } from "../state/bodies";
import { decodeChunk, type FrameColumns } from "./chunk";
import type { Parts } from "./parts";
import { ByteReader, decodePlane } from "./plane";
import { findEvents, type EventQuery } from "./search";
import { selectTable } from "./tables";
import { TrailCollector } from "./trail-collector";

/** Number of decoded parts that are kept: a seek within them is immediate. */
const MAX_KEPT_PARTS = 6;

/** Maximum number of frames, and of points of all bodies together, of which trails are made: more are not kept. */
const MAX_TRAIL_FRAMES = 600;
const MAX_TRAIL_POINTS = 240_000;

/** Size of the digest of a frame. */
const DIGEST_BYTES = 16;

type Metrics = Extract<ReplyBody, { is: "metrics" }>;

/** Keeps the last parts that were read. */
class PartCache<T> {
  readonly #kept = new Map<number, Promise<T>>();
  readonly #read: (part: number) => Promise<T>;

  constructor(read: (part: number) => Promise<T>) {
    this.#read = read;
  }

  get(part: number): Promise<T> {
    const known = this.#kept.get(part);
    this.#kept.delete(part);
    const value = known ?? this.#read(part);
    this.#kept.set(part, value);
    const oldest = this.#kept.keys().next().value;
    if (this.#kept.size > MAX_KEPT_PARTS && oldest !== undefined) this.#kept.delete(oldest);
    return value;
  }
}

export class Recording {
  readonly run: ReplayRun;
  /** Number of frames. */
  readonly count: number;
  readonly #parts: Parts;
  readonly #chunks: PartCache<FrameColumns[]>;
  readonly #agentMetrics: PartCache<Float32Array>;
  readonly #tables: PartCache<ReplayTablesPart>;
  readonly #inspections: PartCache<Map<string, ReplayInspection>>;
  /** The number of the first frame of each chunk. */
  readonly #firsts: number[] = [];
  /** Digests of all frames; none of a run that is shown alone. */
  #digests: Uint8Array | null = null;
  #events: Promise<RunEvent[]> | null = null;
  #metrics: Promise<Metrics> | null = null;

  constructor(run: ReplayRun, parts: Parts) {
    this.run = run;
    this.#parts = parts;
    let count = 0;
    for (const { frames } of run.chunks) {
      this.#firsts.push(count);
      count += frames;
    }
    this.count = count;
    const dimensions = run.scene.dimensions === 3 ? 3 : 2;
    this.#chunks = new PartCache(async (part) => decodeChunk(await parts.bytes(part), dimensions));
    const { agents } = run;
    this.#agentMetrics = new PartCache(async (part) =>
      decodePlane(new ByteReader(await parts.bytes(part)), agents?.agents ?? 0, agents?.cycles.length ?? 0),
    );
    this.#tables = new PartCache((part) => parts.json<ReplayTablesPart>(part));
    this.#inspections = new PartCache(async (part) => byKey(await parts.json<ReplayInspection[]>(part)));
  }

  /** Reads what has to be known of each frame at once. */
  async prepare(): Promise<void> {
    if (this.run.digests !== null) this.#digests = await this.#parts.bytes(this.run.digests);
  }

  /** The digest of the state at a frame, in hexadecimal digits; null where the file has none. */
  digestOf(frame: number): string | null {
    const bytes = this.#digests?.subarray(DIGEST_BYTES * frame, DIGEST_BYTES * (frame + 1));
    return bytes ? [...bytes].map((byte) => byte.toString(16).padStart(2, "0")).join("") : null;
  }

  /** The cycle of a frame. */
  cycleOf(frame: number): number {
    let left = frame;
    for (const [first, step, count] of this.run.cycles) {
      if (left < count) return first + step * left;
      left -= count;
    }
    throw new Error(`the replay has no frame ${frame}`);
  }

  /** The last frame that is not after a cycle; the first one for earlier cycles. */
  frameUntil(cycle: number): number {
    let before = 0;
    let found = 0;
    for (const [first, step, count] of this.run.cycles) {
      if (cycle < first) break;
      found = before + Math.min(count - 1, Math.floor((cycle - first) / step));
      before += count;
    }
    return found;
  }

  /** The first frame that is not before a cycle; the last one for later cycles. */
  frameFrom(cycle: number): number {
    const frame = this.frameUntil(cycle);
    return this.cycleOf(frame) >= cycle ? frame : Math.min(this.count - 1, frame + 1);
  }

  /** The columns of a frame; prepares those that follow. */
  async columns(frame: number): Promise<FrameColumns> {
    const chunk = this.#firsts.findLastIndex((first) => first <= frame);
    const frames = await this.#chunks.get(this.run.chunks[chunk]!.part);
    const next = this.run.chunks[chunk + 1];
    const offset = frame - this.#firsts[chunk]!;
    if (next && offset > frames.length / 2) void this.#chunks.get(next.part);
    return frames[offset]!;
  }

  /** The body table with a number. */
  async table(id: number): Promise<BodyTable> {
    let index = id - 1;
    for (const { part, tables } of this.run.tables) {
      if (index < tables) return selectTable(await this.#tables.get(part), index, id);
      index -= tables;
    }
    throw new Error(`there is no body table ${id}: the file is not whole`);
  }

  /** The reply to a request for the trails of some agents, or of all, up to a cycle, from the last frames before it. */
  async trails(until: number, bodies: readonly BodyId[]): Promise<ReplyBody> {
    const last = this.frameUntil(until);
    const present = await this.table((await this.columns(last)).table);
    const trails = new TrailCollector(present, bodies);
    const agents = trails.trails.length;
    if (agents === 0) return { is: "trails", trails: [] };
    const frames = Math.min(MAX_TRAIL_FRAMES, Math.floor(MAX_TRAIL_POINTS / agents));
    let table = present;
    for (let frame = Math.max(0, last - frames + 1); frame <= last; frame++) {
      const columns = await this.columns(frame);
      if (columns.table !== table.id) table = await this.table(columns.table);
      trails.add(this.cycleOf(frame), columns, table);
    }
    return { is: "trails", trails: trails.trails };
  }

  /** The reply to the request for the scenario. */
  source(): Promise<ReplyBody> {
    return this.#parts.json<ReplyBody>(this.run.source);
  }

  /** The reply to a request for metrics. */
  async metrics(from: number): Promise<ReplyBody> {
    this.#metrics ??= this.#parts.json<Metrics>(this.run.metrics);
    const all = await this.#metrics;
    const first = Math.min(from, all.cycles.length);
    return { ...all, first, cycles: all.cycles.slice(first), values: all.values.map((column) => column.slice(first)) };
  }

  /** The reply to a request for the events of the cycles `from` to before `until`. */
  async events(from: number, until: number, skip: number, limit: number): Promise<ReplyBody> {
    this.#events ??= this.#readEvents();
    const all = await this.#events;
    const wanted = all.slice(
      partitionPoint(all, (event) => event.cycle < from),
      partitionPoint(all, (event) => event.cycle < until),
    );
    const entries = wanted.slice(skip, skip + limit);
    const rest = Math.max(0, wanted.length - skip - entries.length);
    const known_until = this.run.status.cycles_planned + 1;
    const lost = this.run.events_lost.filter(([cycle]) => from <= cycle && cycle < until);
    const left_out = lost.reduce((sum, [, count]) => sum + count, rest);
    return { is: "events", entries, left_out, known_until };
  }

  /** The reply to a search for events. */
  async findEvents(query: EventQuery): Promise<ReplyBody> {
    this.#events ??= this.#readEvents();
    return findEvents(await this.#events, query, namesByBody(this.run.scene.names), this.run.events_left_out);
  }

  /**
   * The reply to a request for metrics of agents: the names of all, or the values of one at the last cycle up to this one
   * that has a row.
   */
  async agentMetrics(metric: string | null, cycle: number): Promise<ReplyBody> {
    const { agents } = this.run;
    if (!agents || metric === null) return { is: "agent-metrics", names: agents?.names ?? [], cycle, values: [] };
    const column = agents.names.findIndex(({ key }) => key === metric);
    const part = agents.parts[column];
    if (part === undefined) {
      const remedy = `ask for one of ${agents.names.map(({ key }) => key).join(", ")}`;
      throw new RequestError(makeProblem(`metric ${metric}`, "no agent of this run has it", remedy));
    }
    const row = Math.max(0, partitionPoint(agents.cycles, (one) => one <= cycle) - 1);
    const all = await this.#agentMetrics.get(part);
    const values = [...all.subarray(row * agents.agents, (row + 1) * agents.agents)];
    const known = values.map((value) => (Number.isFinite(value) ? value : null));
    return { is: "agent-metrics", names: [], cycle: agents.cycles[row]!, values: known };
  }

  /** The inspection of a body in a cycle, with its scans; null if the file has none. */
  async inspection(body: BodyId, cycle: number): Promise<ReplayInspection | null> {
    const spans = this.run.inspections.filter(({ from, until }) => from <= cycle && cycle <= until);
    for (const { part } of spans) {
      const found = (await this.#inspections.get(part)).get(inspectionKey(body, cycle));
      if (found) return found;
    }
    return null;
  }

  async #readEvents(): Promise<RunEvent[]> {
    const read = ({ part }: ReplaySpan): Promise<ReplayEvents> => this.#parts.json<ReplayEvents>(part);
    const parts = await Promise.all(this.run.events.map(read));
    return parts.flatMap(eventsOfColumns);
  }
}

function eventsOfColumns(columns: ReplayEvents): RunEvent[] {
  let cycle = 0;
  return columns.cycle.map((since, i) => ({
    cycle: (cycle += since),
    level: columns.level[i]!,
    kind: columns.kind[i]!,
    body: columns.body[i]!,
    other: columns.other[i]!,
    at_m: columns.at_m[i]!,
    value: columns.value[i]!,
    unit: columns.unit[i]!,
    text: columns.text[i]!,
  }));
}

function inspectionKey(body: BodyId, cycle: number): string {
  return `${cycle} ${bodyKey(body)}`;
}

function byKey(items: ReplayInspection[]): Map<string, ReplayInspection> {
  return new Map(items.map((item) => [inspectionKey(item.inspection.body, item.inspection.cycle), item]));
}

/** The number of first items for which a condition holds, which holds for none after them. */
function partitionPoint<T>(items: readonly T[], holds: (item: T) => boolean): number {
  let [low, high] = [0, items.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (holds(items[middle]!)) low = middle + 1;
    else high = middle;
  }
  return low;
}
