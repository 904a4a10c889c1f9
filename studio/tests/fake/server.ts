/** A small server of the studio's protocol with made-up worlds, which tests stop and restart. */

import { readFileSync } from "node:fs";
import { createServer, type IncomingMessage, type Server, type ServerResponse } from "node:http";
import type { AddressInfo } from "node:net";
import { extname, join, normalize } from "node:path";
import { WebSocketServer, type WebSocket } from "ws";
import {
  VERSION,
  type BodyId,
  type BodyTrail,
  type ClientRequest,
  type FileEntry,
  type Fleet,
  type OpenTarget,
  type Problem,
  type ReplyBody,
  type ServerMethod,
  type ServerNotification,
  type SessionMethod,
  type SessionStatus,
  type SweepRun,
} from "../../src/protocol";
import { bodyKey } from "../../src/format";
import { findEvents } from "../../src/replay/search";
import { namesByBody } from "../../src/state/bodies";
import { check, edited, modelOf, SCHEMA, textOf } from "./edit";
import { declaredEditing } from "./editing";
import { encodeFrame } from "./encode";
import { airplanes, chain, robots, type FakeWorld } from "./scenes";

export const POLICY = "default-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'";
const TYPES: Record<string, string> = {
  ".html": "text/html; charset=utf-8",
  ".js": "text/javascript",
  ".css": "text/css",
  ".svg": "image/svg+xml",
};

const WORLDS: Record<string, () => FakeWorld> = {
  robots: () => robots(24),
  crowd: () => robots(10_000),
  chain,
  airspace: airplanes,
};

function problemOf(cause: string, remedy: string, line: number | null = null, column: number | null = null): Problem {
  return {
    place: "made-up.toml",
    line,
    column,
    end_line: null,
    end_column: null,
    key: null,
    cause,
    remedy,
    is_warning: false,
  };
}

/** The cycle from which runs of seed 2 differ. */
export const PARTING = 137;

/** Eight nodes: all hear all but the last, which none hears and which is late; the third is lost. */
function fleetAt(cycle: number): Fleet {
  const node = (agent: number): Fleet["nodes"][number] => {
    const isLost = agent === 2;
    return {
      agent,
      body: { kind: "airplane", number: agent, part: null },
      state: isLost ? "gone" : "decide",
      epoch: 1,
      round: 3,
      flown: cycle,
      late: agent === 7 ? 4 : 0,
      lives: 1,
      heard: isLost ? [] : [0, 1, 3, 4, 5, 6].filter((other) => other !== agent),
      packets_per_s: 12,
      bytes_per_s: 3456,
      silent_s: isLost ? 12 : agent === 7 ? 3 : 0.2,
    };
  };
  return {
    has_begun: true,
    silent_s: 0,
    late_cycles: 1,
    talk_p50_ms: 12.5,
    talk_p99_ms: 40,
    nodes: Array.from({ length: 8 }, (_, i) => node(i)),
  };
}

class Run {
  isFleet = false;
  credit = 0;
  cycle = 0;
  playing = false;
  speed: SessionStatus["speed"] = { times: 1 };
  seed: string;
  leftOut = 0;
  scansOf: { kind: string; number: number; part: number | null }[] = [];
  text: string;
  #fraction = 0;
  #owed = false;
  readonly id: number;
  readonly world: FakeWorld;
  readonly #socket: WebSocket;

  constructor(id: number, world: FakeWorld, seed: number | null, socket: WebSocket) {
    this.id = id;
    this.world = world;
    this.#socket = socket;
    this.seed = String(seed ?? 1);
    this.text = textOf(world.scene.world);
  }

  /** The trails of some agents, or of all, up to a cycle. */
  trails(until: number, bodies: readonly BodyId[]): ReplyBody {
    const { scene, table, columns } = this.world;
    const d = scene.dimensions;
    const trails = table.is_agent.flatMap((isAgent, index): (BodyTrail & { index: number })[] => {
      const part = table.part[index]!;
      const kind = table.kinds[table.kind[index]!]!;
      const body = { kind, number: table.number[index]!, part: part < 0 ? null : part };
      const isWanted = bodies.length === 0 || bodies.some((one) => bodyKey(one) === bodyKey(body));
      return isAgent && isWanted ? [{ body, cycles: [], points_m: [], index }] : [];
    });
    for (let cycle = Math.max(0, until - 600); cycle <= until; cycle++) {
      const { positions_m } = columns(cycle);
      for (const { index, cycles, points_m } of trails) {
        cycles.push(cycle);
        points_m.push(positions_m[d * index]!, positions_m[d * index + 1]!, d === 3 ? positions_m[3 * index + 2]! : 0);
      }
    }
    return { is: "trails", trails: trails.map(({ body, cycles, points_m }) => ({ body, cycles, points_m })) };
  }

  status(): SessionStatus {
    const { cyclesPlanned: planned, scene } = this.world;
    const isOver = this.cycle >= planned;
    if (this.isFleet) {
      return {
        session: this.id,
        state: isOver ? "over" : "watched",
        cycle: this.cycle,
        cycles_planned: planned,
        time_s: this.cycle * scene.cycle_s,
        speed: { times: 1 },
        cycles_per_s: 0,
        seed: this.seed,
        digest: null,
        banner: null,
        fleet: fleetAt(this.cycle),
      };
    }
    return {
      session: this.id,
      state: isOver ? "over" : this.playing ? "playing" : "paused",
      cycle: this.cycle,
      cycles_planned: planned,
      time_s: this.cycle * scene.cycle_s,
      speed: this.speed,
      cycles_per_s: this.playing ? 10 : 0,
      seed: this.seed,
      digest: this.playing && !isOver ? null : this.digest(),
      banner: null,
      fleet: null,
    };
  }

  /** Runs of the seed 2 part from the others. */
  get hasParted(): boolean {
    return this.seed === "2" && this.cycle >= PARTING;
  }

  digest(): string {
    return `a1b2c3d4${this.cycle.toString(16).padStart(6, "0")}${this.hasParted ? "ff" : "00"}`;
  }

  bodyTable(): ServerNotification {
    return { notice: "bodies", session: this.id, id: 1, ...this.world.table };
  }

  tick(seconds: number): void {
    if (this.playing && this.cycle < this.world.cyclesPlanned) {
      const times = this.speed === "fastest" ? 100 : this.speed.times;
      this.#fraction += this.speed === "fastest" ? 3 : (times * seconds) / this.world.scene.cycle_s;
      const whole = Math.floor(this.#fraction);
      this.#fraction -= whole;
      if (whole > 0) this.goTo(this.cycle + whole);
    } else if (this.#owed) this.send();
  }

  goTo(cycle: number): void {
    this.cycle = Math.min(this.world.cyclesPlanned, Math.max(0, cycle));
    if (this.#owed) this.leftOut++;
    this.#owed = true;
    this.send();
  }

  send(): void {
    if (this.credit === 0) return;
    this.credit--;
    this.#owed = false;
    const { scene } = this.world;
    const columns = this.world.columns(this.cycle);
    // The fourth body stands elsewhere.
    if (this.hasParted) columns.positions_m[3 * scene.dimensions]! += 0.25;
    const text = {
      scans: this.scansOf.flatMap((who) => this.world.scans(who, this.cycle)),
      events: [],
      events_left_out: 0,
    };
    this.#socket.send(
      encodeFrame({
        session: this.id,
        tableId: 1,
        dimensions: scene.dimensions as 2 | 3,
        cycle: this.cycle,
        time_s: this.cycle * scene.cycle_s,
        leftOut: this.leftOut,
        text,
        ...columns,
      }),
    );
  }
}

export class FakeServer {
  readonly calls: (ServerMethod | SessionMethod)[] = [];
  port = 0;
  /** Subjects that the command line would have asked to open. */
  open: OpenTarget[] = [];
  /** The text that a file would have by now, if another program had changed it. */
  theirs: string | null = null;
  /** The status of the sign-in; anything but 204 refuses sockets, too. */
  entrance = 204;
  readonly #dist: string;
  #http: Server | null = null;
  #sockets: WebSocketServer | null = null;
  #timer: ReturnType<typeof setInterval> | null = null;
  #runs = new Map<number, Run>();
  #next = 1;

  constructor(dist: string) {
    this.#dist = dist;
  }

  get url(): string {
    return `http://127.0.0.1:${this.port}/`;
  }

  async start(): Promise<void> {
    const http = createServer((request, response) => {
      if (request.url === "/enter") return void response.writeHead(this.entrance).end();
      if (/^\/(report|export)\?/.test(request.url ?? "")) return void result(request.url!, response);
      if (request.url?.startsWith("/picture?")) return void picture(response);
      if (request.url?.startsWith("/drop?")) return void this.#drop(request, response);
      const path = normalize(new URL(request.url ?? "/", "http://x").pathname);
      const file = path === "/" ? "/index.html" : path;
      try {
        const body = readFileSync(join(this.#dist, file));
        response.writeHead(200, {
          "content-type": TYPES[extname(file)] ?? "application/octet-stream",
          "content-security-policy": POLICY,
        });
        response.end(body);
      } catch {
        response.writeHead(404).end();
      }
    });
    this.#sockets = new WebSocketServer({ server: http, path: "/socket" });
    this.#sockets.on("connection", (socket) => this.#greet(socket));
    await new Promise<void>((ready) => http.listen(this.port, "127.0.0.1", ready));
    this.port = (http.address() as AddressInfo).port;
    this.#http = http;
    this.#timer = setInterval(() => this.#tick(), 33);
  }

  /** Paths and contents of the files that were dropped. */
  readonly dropped: [string, string][] = [];

  #drop(request: IncomingMessage, response: ServerResponse): void {
    const path = new URL(request.url ?? "", "http://x").searchParams.get("path") ?? "";
    const chunks: Buffer[] = [];
    request.on("data", (chunk: Buffer) => chunks.push(chunk));
    request.on("end", () => {
      this.dropped.push([path, Buffer.concat(chunks).toString()]);
      response.writeHead(200, { "content-type": "text/plain" }).end(`/copies/${path}`);
    });
  }

  /** Dies as a killed process does. */
  async stop(): Promise<void> {
    if (this.#timer) clearInterval(this.#timer);
    for (const socket of this.#sockets?.clients ?? []) socket.terminate();
    this.#runs.clear();
    this.#next = 1;
    const http = this.#http;
    http?.closeAllConnections();
    await new Promise((closed) => (http ? http.close(closed) : closed(null)));
  }

  /** Ends all sessions by themselves, and says why. */
  endAll(): void {
    for (const session of this.#runs.keys()) {
      const notice: ServerNotification = {
        notice: "ended",
        session,
        problem: problemOf("the disk is full", "make room and start again"),
      };
      for (const socket of this.#sockets?.clients ?? []) socket.send(JSON.stringify(notice));
    }
    this.#runs.clear();
  }

  /** Frames that the page was too slow for. */
  leftOut(): number {
    return Math.max(0, ...[...this.#runs.values()].map((run) => run.leftOut));
  }

  #greet(socket: WebSocket): void {
    if (this.entrance !== 204) return socket.terminate();
    const say = (words: unknown): void => socket.send(JSON.stringify(words));
    say({
      notice: "hello",
      version: VERSION,
      program: "sidestep 0.0.0 (made up)",
      worlds: Object.keys(WORLDS),
      read_only: false,
      open: this.open,
    });
    const mine = new Set<number>();
    socket.on("message", (data) => {
      const request = JSON.parse(String(data)) as ClientRequest;
      const { id } = request;
      this.calls.push(request.call);
      try {
        const answer =
          "session" in request
            ? this.#answerSession(request.session, request.call, say)
            : this.#answer(request.call, socket);
        if (answer.is === "opened") mine.add(answer.session);
        say({ id, answer });
        if (answer.is === "opened") say(this.#runs.get(answer.session)!.bodyTable());
      } catch (problem) {
        say({ id, problem });
      }
    });
    socket.on("close", () => mine.forEach((id) => this.#runs.delete(id)));
  }

  #save(to: string | null, overwrite: boolean): ReplyBody {
    if (this.theirs !== null && !overwrite) return { is: "differs", text: this.theirs };
    this.theirs = null;
    return { is: "saved", place: to ?? "made-up.toml" };
  }

  #tick(): void {
    for (const run of this.#runs.values()) {
      const before = JSON.stringify(run.status());
      run.tick(0.033);
      if (JSON.stringify(run.status()) !== before) this.#sendStatus(run);
    }
  }

  #sendStatus(run: Run): void {
    const text = JSON.stringify({ notice: "status", ...run.status() });
    for (const socket of this.#sockets?.clients ?? []) socket.send(text);
  }

  #answer(call: ServerMethod, socket: WebSocket): ReplyBody {
    if (call.do === "files") return files(call.folder);
    if (call.do === "find") return found(call.text);
    if (call.do === "gallery") return GALLERY;
    if (call.do === "identify") return identified(call.path);
    if (call.do === "usage") return usage([...this.#runs.keys()]);
    if (call.do === "import-report") return importReport(call.path);
    if (call.do === "runs") return runs();
    if (call.do === "open") {
      const { target: what } = call;
      const key =
        what.kind === "fleet"
          ? "airspace"
          : what.kind === "new"
            ? what.world
            : (what.kind === "shipped" ? what.name : (what.path.split("/").at(-1) ?? ""))
                .replace("broken", "robots")
                .replace(/\.\w+$/, "");
      const world = WORLDS[key]?.();
      if (!world) throw { ...problemOf("there is no such scenario", "choose another one"), place: key };
      if (what.kind === "recording") world.scene.is_recording = true;
      if (what.kind === "recording" && call.seed !== null)
        throw problemOf("a recording has a seed of its own", "open its scenario");
      const run = new Run(this.#next++, world, call.seed, socket);
      run.isFleet = run.playing = what.kind === "fleet";
      this.#runs.set(run.id, run);
      run.goTo(0);
      return { is: "opened", session: run.id, scene: world.scene, status: run.status() };
    }
    return { is: "schema", schema: SCHEMA, editing: declaredEditing(call.world) };
  }

  #answerSession(session: number, call: SessionMethod, say: (words: unknown) => void): ReplyBody {
    const run = this.#runs.get(session);
    if (!run) throw problemOf("no such session", "open it again");
    if (run.isFleet && !["close", "credit", "select-scans", "events", "tables"].includes(call.do)) {
      throw problemOf("a fleet is only watched here", "control it where it was started");
    }
    const answer = call.do === "save" ? this.#save(call.to, call.overwrite) : act(call, run);
    if (call.do === "close") this.#runs.delete(run.id);
    if (answer.is === "done") say({ notice: "status", ...run.status() });
    return answer;
  }
}

/** A picture of a scenario: any will do. */
function picture(response: ServerResponse): void {
  const png = readFileSync(new URL("../../../docs/src/pictures/studio.png", import.meta.url));
  response.writeHead(200, { "content-type": "image/png" }).end(png);
}

/** Reports and exports, with the headers of the real server. */
function result(url: string, response: ServerResponse): void {
  const fields = new URL(url, "http://x").searchParams;
  const part = fields.get("as");
  // A refusal may be shown in no frame.
  if (fields.get("path") === "broken.run") {
    return void response
      .writeHead(422, { "content-type": "text/plain", "x-frame-options": "DENY" })
      .end("broken.run/run.json: it is cut off\nhelp: record it again\n");
  }
  if (part === "figures")
    return void response.writeHead(200, { "content-type": "application/json" }).end('["01-speed"]');
  const policy =
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; frame-ancestors 'self'";
  const kept = part === null ? {} : { "content-disposition": `attachment; filename="made-up.${part}"` };
  response.writeHead(200, {
    "content-type": "text/html",
    "content-security-policy": policy,
    "x-frame-options": "SAMEORIGIN",
    ...kept,
  });
  response.end(`<!doctype html><title>r</title><h1>Report of ${fields.get("path")}</h1><p id="p">no script</p>
  ${fields.get("path") === "sweep" ? VARIANTS : ""}<script>
    document.getElementById("p").textContent = "origin " + origin;
    fetch("/enter").then(() => (document.title = "reached"), () => (document.title = "kept in"));
  </script><script>${REPORT_SCRIPT}</script>`);
}

/** The script of the program's own reports. */
const REPORT_SCRIPT = readFileSync(new URL("../../../crates/report/src/html/page.js", import.meta.url), "utf8");

const VARIANTS = `<div class="wide"><div class="scrolled"><table class="sortable">
  <thead><tr><th scope="col">variant</th><th scope="col">mean</th></tr></thead>
  <tbody><tr><th scope="row">count = 4</th><td>1</td></tr><tr><th scope="row">0001</th><td>2</td></tr></tbody></table></div></div>`;

function files(folder: string | null): ReplyBody {
  if (folder !== null)
    return {
      is: "files",
      left_out: 0,
      entries: [{ path: "crowd.toml", name: "crowd.toml", kind: "scenario", about: "Ten thousand robots" }],
    };
  return {
    is: "files",
    left_out: 0,
    entries: [
      { path: "more", name: "more", kind: "folder", about: "" },
      ...["robots", "chain", "airspace"].map((name) => ({
        path: `${name}.toml`,
        name: `${name}.toml`,
        kind: "scenario" as const,
        about: "made up",
      })),
      { path: "nowhere.toml", name: "nowhere.toml", kind: "scenario", about: "cannot be opened" },
      { path: "robots.run", name: "robots.run", kind: "run", about: "made up" },
      { path: "broken.run", name: "broken.run", kind: "run", about: "cut off" },
      { path: "chain.mcap", name: "chain.mcap", kind: "recording", about: "made up" },
      { path: "sweep", name: "sweep", kind: "sweep", about: "40 runs" },
    ],
  };
}

/** All files of all folders. */
function found(text: string): ReplyBody {
  const entries = [
    { path: "more/crowd.toml", name: "more/crowd.toml", kind: "scenario" as const, about: "Ten thousand robots" },
    { path: "more/hall.map", name: "more/hall.map", kind: "map" as const, about: "map of MovingAI" },
    { path: "more/arm.urdf", name: "more/arm.urdf", kind: "model" as const, about: "links and joints of a robot" },
    { path: "more/lag.sweep.toml", name: "more/lag.sweep.toml", kind: "sweep" as const, about: "Lag" },
    { path: "robots.toml", name: "robots.toml", kind: "scenario" as const, about: "made up" },
  ];
  return {
    is: "files",
    left_out: text === "" ? 7 : 0,
    entries: entries.filter(({ name, about }) => `${name} ${about}`.toLowerCase().includes(text.toLowerCase())),
  };
}

const GALLERY: ReplyBody = {
  is: "gallery",
  entries: [
    { name: "robots", world: "robots", title: "Office building", about: "Twenty-four robots of three sizes." },
    { name: "crowd", world: "robots", title: "A crowd", about: "Ten thousand robots in a hall." },
    { name: "chain", world: "chain", title: "Serpentine", about: "A robot with a laser, and fifteen that follow it." },
  ],
};

/** What a file is by its name. */
function identified(path: string): ReplyBody {
  const name = path.split("/").at(-1) ?? path;
  const kinds: [RegExp, FileEntry["kind"]][] = [
    [/sweep\.toml$/, "sweep"],
    [/\.toml$/, "scenario"],
    [/\.map$/, "map"],
    [/\.mcap$/, "recording"],
    [/\.run$/, "run"],
  ];
  const kind = kinds.find(([ending]) => ending.test(name))?.[1];
  if (!kind)
    throw { ...problemOf("is nothing that the studio opens", "choose a scenario (.toml), a map"), place: name };
  return { is: "identified", entry: { path, name, kind, about: "" } };
}

function usage(sessions: number[]): ReplyBody {
  return {
    is: "usage",
    sessions: sessions.length,
    max_sessions: 12,
    resident_bytes: 123_456_789,
    stores: [
      ...sessions.map((session) => ({ session, name: "events", bytes: 2048, max_bytes: 40 << 20 })),
      { session: null, name: "dropped files, on the disk", bytes: 0, max_bytes: 2 * 2 ** 30 },
    ],
  };
}

/** A report on a made-up file: there is something to tell about those whose name says so. */
function importReport(path: string): ReplyBody {
  return {
    is: "import-report",
    lines: [
      ["format", "recorded tracks"],
      ["rows", "120"],
    ],
    findings: path.includes("bad") ? ["dropped: rows without a position (7 times), line 3, line 9, line 12, ..."] : [],
  };
}

function runs(): ReplyBody {
  const run = (variant: string, seed: number, failure = ""): SweepRun => ({
    variant,
    seed: String(seed),
    failure,
    replay: { kind: "scenario", path: "robots.toml" },
    // The third run of the first variant lies far from the others.
    values: failure ? [null, null] : [variant === "count = 4" && seed === 3 ? 90 : 10 + seed, 0.5 + 1e-9 * seed],
    outliers: variant === "count = 4" && seed === 3 ? [{ column: 0, is_high: true, distance_ranges: 30 }] : [],
  });
  return {
    is: "runs",
    name: "Made-up sweep",
    is_complete: false,
    left_out: 0,
    columns: [
      { key: "contacts", label: "contacts", unit: "" },
      { key: "speed", label: "mean speed", unit: "m/s" },
    ],
    columns_left_out: 4,
    outlier_rule: "An outlier lies more than 1.5 interquartile ranges outside the quartiles.",
    runs: [...[1, 2, 3, 4, 5, 6].map((seed) => run("count = 4", seed)), run("count = 8", 1, "the disk is full")],
  };
}

function act(call: Exclude<SessionMethod, { do: "save" }>, run: Run): ReplyBody {
  switch (call.do) {
    case "play":
      run.playing = true;
      run.speed = call.speed;
      return { is: "done" };
    case "pause":
      run.playing = false;
      return { is: "done" };
    case "step":
      run.playing = false;
      run.goTo(run.cycle + call.cycles);
      return { is: "done" };
    case "trails":
      return run.trails(call.until, call.bodies);
    case "seek":
      run.goTo(call.cycle);
      return { is: "done" };
    case "select-scans":
      run.scansOf = call.bodies;
      run.goTo(run.cycle);
      return { is: "done" };
    case "credit":
      run.credit += call.frames;
      run.tick(0);
      return { is: "done" };
    case "close":
      return { is: "done" };
    case "restart":
      return restart(run, call.seed, call.text);
    case "inspect":
      return { is: "inspection", ...run.world.inspect(call.body, run.cycle) };
    case "metrics":
      return metrics(run, call.from);
    case "agent-metrics":
      return agentMetrics(run, call.metric);
    case "find-events": {
      const all = run.world.events(0, run.cycle);
      return findEvents(all, call, namesByBody(run.world.scene.names), 0);
    }
    case "events": {
      const all = run.world.events(call.from, call.until).slice(call.skip ?? 0);
      return {
        is: "events",
        entries: all.slice(0, call.limit),
        left_out: Math.max(0, all.length - call.limit),
        known_until: call.until,
      };
    }
    case "tables":
      return { is: "tables", names: run.world.scene.is_recording ? ["events", "trajectories"] : [] };
    case "source":
      return { is: "source", place: "made-up.toml", text: run.text, read_only: false };
    case "check":
      return { is: "problems", problems: check(call.text) };
    case "edit":
      return { is: "edited", text: edited(call.text, call.edits) };
    case "model":
      return model(call.text);
  }
}

function restart(run: Run, seed: number | null, text: string | null): ReplyBody {
  const [problem] = check(text ?? run.text).filter((one) => !one.is_warning);
  if (problem) throw problem;
  run.text = text ?? run.text;
  run.seed = String(seed ?? run.seed);
  run.playing = false;
  run.goTo(0);
  return { is: "opened", session: run.id, scene: run.world.scene, status: run.status() };
}

function model(text: string): ReplyBody {
  try {
    return { is: "model", value: modelOf(text), files: [] };
  } catch (error) {
    throw problemOf(String(error), "write TOML");
  }
}

/** Trips of each agent, every tenth of which has had none and has no mean. */
function agentMetrics(run: Run, metric: string | null): ReplyBody {
  const { number, is_agent } = run.world.table;
  const agents = number.filter((_, i) => is_agent[i]);
  const names = [
    { key: "trips", label: "trips completed", unit: "", is_primary: true },
    { key: "trip_cycles_mean", label: "mean length of a trip", unit: "cycles", is_primary: false },
  ];
  const known = names.find(({ key }) => key === metric);
  if (metric !== null && !known) throw problemOf("no agent of this run has it", "ask for trips");
  const valueOf = (agent: number): number | null => {
    if (known?.key === "trips") return Math.floor(run.cycle / 10) * (agent % 10);
    return agent % 10 === 0 ? null : 20 + agent;
  };
  const values = metric === null ? [] : agents.map(valueOf);
  return { is: "agent-metrics", names: metric === null ? names : [], cycle: run.cycle, values };
}

function metrics(run: Run, from: number): ReplyBody {
  const cycles = Array.from({ length: Math.floor(run.cycle / 10) + 1 }, (_, i) => 10 * i).slice(from);
  const value = (k: number, c: number): number | null =>
    k === 3 && c < 50 ? null : (k + 1) * (2 + Math.sin(c / (20 + 9 * k)));
  const names = [
    ["contacts", "contacts per cycle", ""],
    ["speed", "mean speed", "m/s"],
    ["group", "largest group", "robots"],
    ["messages", "messages", "kB"],
  ];
  return {
    is: "metrics",
    names: names.map(([key, label, unit]) => ({ key: key!, label: label!, unit: unit!, is_primary: true })),
    first: from,
    cycles,
    values: names.map((_, k) => cycles.map((c) => value(k, c))),
    present: { cycle: run.cycle, values: names.map((_, k) => value(k, run.cycle)) },
  };
}
