/**
 * One open run. Each concern has a store of its own, which panels use directly; this class connects them and follows
 * the session through opening, loss, restart and end.
 */

import { linksBetweenBodies, type Link } from "../fleet/links";
import { initialSpeed } from "../format";
import type { BodyTable, OpenTarget, Problem, ReplyBody, RunEvent, SessionStatus, Speed } from "../protocol";
import { AgentMetrics } from "./agent-metrics.svelte";
import { metricOf } from "./color-mode";
import { Display } from "./display.svelte";
import { EventSearch } from "./event-search.svelte";
import { Events } from "./events.svelte";
import { Frames } from "./frames.svelte";
import { Metrics } from "./metrics.svelte";
import { Playback } from "./playback.svelte";
import { RunState } from "./run-state.svelte";
import { Selection } from "./selection.svelte";
import { SessionClient, type SessionHost } from "./session-client.svelte";
import { TrailSource } from "./trail-source";

type Opened = Extract<ReplyBody, { is: "opened" }>;

let keys = 0;

export class Session {
  /** The page's own number, which stays when the server assigns another id. */
  readonly key = ++keys;
  readonly target: OpenTarget;
  readonly client: SessionClient;
  readonly run = new RunState();
  readonly frames: Frames;
  readonly playback: Playback;
  readonly selection: Selection;
  readonly events = new Events();
  readonly eventSearch = new EventSearch();
  readonly metrics = new Metrics();
  readonly agentMetrics = new AgentMetrics();
  readonly display = new Display();
  readonly trailSource: TrailSource;
  /** The state when the connection was lost, until it is restored. */
  #resumeState: { cycle: number; isPlaying: boolean; seed: number | null } | null = null;

  constructor(target: OpenTarget, host: SessionHost) {
    this.target = target;
    this.client = new SessionClient(host);
    this.frames = new Frames(this.client, {
      isAfterSeek: () => this.playback.onFrame(),
      onShown: (frame) => {
        this.events.addOfFrame(frame.text.events);
        this.selection.scheduleInspection();
      },
    });
    this.playback = new Playback(this.client, this.run, this.frames, !this.isFleet);
    this.trailSource = new TrailSource(this.client);
    this.selection = new Selection(this.client, this.frames, !this.isFleet);
  }

  /** Returns whether it is a fleet that runs elsewhere: it is watched and not controlled. */
  get isFleet(): boolean {
    return this.target.kind === "fleet";
  }

  /** Returns whether it is a run of a replay in one file: it is only shown. */
  get isReplay(): boolean {
    return this.client.isReplay;
  }

  /** The folder of the recording, if it is one on a server: only folders have reports. */
  get folder(): string | null {
    const { target } = this;
    if (this.isReplay) return null;
    return target.kind === "recording" && !/\.mcap$/i.test(target.path) ? target.path : null;
  }

  /** The seed to open it with again; null for a recording, which has its own. */
  get seed(): number | null {
    return this.#resumeState ? this.#resumeState.seed : this.#ownSeed;
  }

  get #ownSeed(): number | null {
    return this.target.kind === "recording" || this.isFleet ? null : this.run.seed;
  }

  /** Pairs that hear each other in a fleet, by the indices of bodies; of the selected agent alone where one is. */
  get links(): Link[] {
    const { bodies } = this.frames;
    const { fleet } = this.run.status;
    return fleet && bodies ? linksBetweenBodies(fleet, bodies, this.selection.body) : [];
  }

  /** The server has opened it (again). */
  onOpened(answer: Opened): void {
    this.client.id = answer.session;
    const isFirst = this.run.starts === 0;
    if (isFirst) this.playback.speed = firstSpeed(answer, this.isReplay);
    this.#onStart(answer);
    this.frames.credit.reset();
    this.frames.credit.refill();
    this.selection.selectScans();
  }

  /** The connection was lost; session ids belong to the server, and a new one assigns them anew. */
  onConnectionLost(): void {
    this.client.id = 0;
    this.#cancelWaits();
    const { cycle } = this.frames;
    // Lost again while resuming: the state before the first loss is still the one to restore.
    this.#resumeState ??= { cycle, isPlaying: this.run.isPlaying, seed: this.#ownSeed };
  }

  /** Seeks to the cycle where it was, once reopened, and plays if it was playing. Returns the cycle. */
  async resume(): Promise<number> {
    const { cycle, isPlaying, seed } = this.#resumeState ?? { cycle: 0, isPlaying: false, seed: null };
    const { id } = this.client;
    if (this.isFleet) {
      this.#resumeState = null;
      return this.frames.cycle;
    }
    if (this.run.text !== null) await this.restart(seed, this.run.text);
    if (cycle > 0) await this.playback.seekTo(cycle);
    // Lost once more: the next connection resumes from the same state.
    if (id !== this.client.id) return cycle;
    this.#resumeState = null;
    if (isPlaying) this.playback.play();
    return cycle;
  }

  /** Restarts the run. Returns whether the server accepted. */
  async restart(seed: number | null, text: string | null): Promise<boolean> {
    this.playback.interrupt();
    const answer = await this.client.send({ do: "restart", seed, text });
    if (answer === null) return false;
    if (text !== null) this.run.text = text;
    if (answer.is === "opened") this.#onStart(answer);
    else this.#onStart({ scene: this.run.scene, status: { ...this.run.status, cycle: 0 } });
    this.frames.credit.refill();
    this.selection.selectScans();
    return true;
  }

  onBodyTable(table: BodyTable): void {
    this.frames.onBodyTable(table, this.run.scene);
  }

  onFrame(bytes: ArrayBuffer): void {
    this.frames.onFrame(bytes);
  }

  onStatus(status: SessionStatus): void {
    this.run.status = status;
    this.playback.onStatus();
  }

  onEnded(problem: Problem): void {
    this.client.ended = problem;
    this.run.onEnded();
    this.#cancelWaits();
  }

  /** Fetches events and metrics; called regularly while the session is shown. */
  refresh(withMetrics: boolean): void {
    if (this.client.ended) return;
    const { scene, status, lastCycle } = this.run;
    const cycle = 1 + (scene.is_recording ? lastCycle : Math.max(status.cycle, this.frames.cycle));
    const ignore = (): void => undefined;
    this.events
      .fetch(cycle, (from, until, skip, limit) => this.client.request({ do: "events", from, until, skip, limit }))
      .catch(ignore);
    this.eventSearch.refresh(this.events.total, this.findEvents).catch(ignore);
    this.agentMetrics.fetchNames(this.#askAgents).catch(ignore);
    const colorMetric = metricOf(this.display.colors);
    if (colorMetric !== null)
      this.agentMetrics.fetchValues(colorMetric, this.frames.cycle, this.#askAgents).catch(ignore);
    if (withMetrics && !this.isFleet)
      this.metrics.fetch((from) => this.client.request({ do: "metrics", from })).catch(ignore);
  }

  readonly #askAgents = (metric: string | null): Promise<ReplyBody> =>
    this.client.request({ do: "agent-metrics", metric });

  /** Has all that the picture of the shown frame consists of: trails, and the values that agents are colored by. */
  async completePicture(): Promise<void> {
    await this.trailSource.settle();
    const metric = metricOf(this.display.colors);
    if (metric !== null) await this.agentMetrics.completeValues(metric, this.frames.cycle, this.#askAgents);
  }

  /** Asks the server for the events with some words. */
  readonly findEvents = (text: string, kinds: string[] | null, skip: number, limit: number): Promise<ReplyBody> =>
    this.client.request({ do: "find-events", text, kinds, skip, limit });

  /** Searches all events for a text, among the kinds that are not hidden. */
  searchEvents(text: string): void {
    const { kinds, hiddenKinds } = this.events;
    const shown = hiddenKinds.size === 0 ? null : [...kinds.keys()].filter((kind) => !hiddenKinds.has(kind));
    this.eventSearch.type(text, shown, this.findEvents);
  }

  /** Seeks to an event, and selects its agent. */
  visit(event: RunEvent): void {
    const { bodies } = this.frames;
    const agent = [event.body, event.other].find((body) => body && bodies?.isAgent(body));
    if (agent) this.selection.select(agent);
    this.playback.seek(event.cycle);
  }

  /** Jumps to the next or previous visible event. */
  jump(direction: 1 | -1): void {
    const event = this.events.neighbor(this.frames.cycle, direction);
    if (event) this.visit(event);
  }

  /** The page has closed it: pending requests no longer matter. */
  dispose(): void {
    this.events.clear();
    this.client.sendQuietly({ do: "close" });
    this.playback.interrupt();
    this.client.id = 0;
    this.#cancelWaits();
    this.frames.dispose();
    this.selection.dispose();
    this.trailSource.dispose();
  }

  #onStart({ scene, status }: Pick<Opened, "scene" | "status">): void {
    this.client.ended = null;
    this.run.onStart(scene, status);
    this.events.clear();
    this.eventSearch.clear();
    this.metrics.clear();
    this.agentMetrics.clear();
    this.selection.onStart();
    this.frames.onStart();
    this.playback.onStart();
  }

  /** Ends what waits for the server, which cannot reply. */
  #cancelWaits(): void {
    this.playback.cancel();
    this.frames.cancelWaits();
  }
}

/** The speed at which a session opens: of a replay that of its file, with which a run is over within a minute. */
function firstSpeed({ scene, status }: Opened, isReplay: boolean): Speed {
  const times = initialSpeed(scene.cycle_s);
  if (!isReplay || status.speed === "fastest") return { times };
  return { times: Math.max(times, status.speed.times) };
}
