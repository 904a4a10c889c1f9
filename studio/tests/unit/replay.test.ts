/** Replays in one file: planes and frames are read as they were written, and the socket answers as a server does. */

import { deflateRawSync, inflateRawSync } from "node:zlib";
import { expect, test, vi } from "vitest";
import { decodeFrame } from "../../src/decode";
import {
  VERSION,
  type BodyId,
  type BodyTable,
  type ReplayFile,
  type ReplayInspection,
  type ReplayTablesPart,
  type SessionStatus,
} from "../../src/protocol";
import { decodeChunk, frameBytes } from "../../src/replay/chunk";
import { formatLink, LinkRequest, parseLink } from "../../src/replay/link.svelte";
import { partsOf } from "../../src/replay/parts";
import { ByteReader, decodePlane } from "../../src/replay/plane";
import { selectTable } from "../../src/replay/tables";
import { ReplaySocket } from "../../src/replay/socket";
import { Studio } from "../../src/state/studio.svelte";

class Bytes {
  readonly list: number[] = [];

  u8(...values: number[]): this {
    this.list.push(...values.map((value) => value & 255));
    return this;
  }

  u32(...values: number[]): this {
    for (const value of values) this.u8(value, value >>> 8, value >>> 16, value >>> 24);
    return this;
  }

  f32(...values: number[]): this {
    return this.u8(...new Uint8Array(Float32Array.from(values).buffer));
  }
}

const planeOf = (bytes: Bytes, channels: number, times: number): number[] => [
  ...decodePlane(new ByteReader(Uint8Array.from(bytes.list)), channels, times),
];

test("scaled planes follow differences, lines, and channels with the same values", () => {
  // Steps of 1/4; channel 0: 2, 3, 1; channel 1 the same; channel 2: 300, 300, 300.
  const steps = new Bytes().u8(1, -2, 1, 1, 1).u32(0, 1, 0).u32(4, 596).u8(2, 3, 0, 0);
  expect(planeOf(steps, 3, 3)).toEqual([0.5, 0.5, 75, 0.75, 0.75, 75, 0.25, 0.25, 75]);
  // Second order, two bytes wide: 0, 200, 400, 601.
  const line = new Bytes()
    .u8(1, 0, 2, 2, 0)
    .u32(0)
    .u8(400 & 255, 0, 2)
    .u8(400 >> 8, 0, 0);
  expect(planeOf(line, 1, 4)).toEqual([0, 200, 400, 601]);
});

test("listed and raw planes are exact", () => {
  const listed = new Bytes().u8(2).u32(2).f32(1.5, -0.1).u8(1, 1, 0).u32(0).u8(2, 1);
  expect(planeOf(listed, 1, 3)).toEqual([1.5, Math.fround(-0.1), 1.5]);
  expect(planeOf(new Bytes().u8(0).f32(1, 2, Infinity, 4), 2, 2)).toEqual([1, Infinity, 2, 4]);
  expect(planeOf(new Bytes().u8(1, 0, 1, 1, 0), 0, 5)).toEqual([]);
});

/** A chunk of some frames of one body and one line, which move by a meter per frame. */
function chunk(frames: number): Uint8Array {
  const later = Array.from({ length: frames - 1 }, () => 2);
  const rest = later.map(() => 0);
  const bytes = new Bytes().u32(1).u32(1, frames, 2, 1, 2).u32(0).u32(0, 2);
  bytes.u8(1, 0, 1, 1, 0).u32(0, 0, 0, 0, 0, 0, 0, 0);
  bytes.u8(...later, ...rest, ...rest, ...rest, ...later, ...rest, ...rest, ...rest);
  bytes
    .u8(1, 0, 1, 1, 0)
    .u32(0, 0)
    .u8(...rest, ...rest);
  bytes
    .u8(1, 0, 1, 1, 0)
    .u32(0, 8)
    .u8(...rest, ...rest);
  return Uint8Array.from(bytes.list);
}

test("a frame is that which the server would have sent", () => {
  const frames = decodeChunk(chunk(4), 2);
  expect(frames.length).toBe(4);
  const head = { session: 7, cycle: 30, time_s: 1.5, text: null };
  const frame = decodeFrame(frameBytes(frames[3]!, head));
  expect(frame).toMatchObject({ session: 7, tableId: 1, cycle: 30, time_s: 1.5, bodies: 2 });
  expect([...frame.positions_m]).toEqual([3, 0, 0, 0]);
  expect([...frame.points_m]).toEqual([3, 0, 0, 0]);
  expect([...frame.lineStarts]).toEqual([0, 2]);
  expect([...frame.conditions]).toEqual([0, 4]);
});

const robot = (number: number) => ({ kind: "robot", number, part: null });

function replayText(): string {
  const appearance = { color: [1, 2, 3], opacity: 1, layer: 0 };
  const looks = Array.from({ length: 5 }, () => appearance) as unknown as BodyTable["appearances"][0];
  const table: BodyTable = {
    session: 0,
    id: 1,
    kinds: ["robot", "rope"],
    kind: [0, 1],
    number: [3, 0],
    part: [-1, -1],
    shapes: [
      { type: "sphere", radius_m: 1 },
      { type: "line", points_m: [], thickness_m: 0 },
    ],
    shape: [0, 1],
    appearances: [looks],
    appearance: [0, 0],
    names: [],
    is_agent: [true, false],
  };
  const status: SessionStatus = {
    session: 0,
    state: "paused",
    cycle: 0,
    cycles_planned: 30,
    time_s: 0,
    speed: { times: 1 },
    cycles_per_s: 0,
    seed: "1",
    digest: null,
    banner: "A recorded run.",
    fleet: null,
  };
  const event = { level: "info", kind: "contact", text: "touched" };
  const events = {
    cycle: [3, 0, 20],
    level: Array<string>(3).fill(event.level),
    kind: Array<string>(3).fill(event.kind),
    body: [robot(3), null, null],
    other: [null, null, null],
    at_m: [null, null, null],
    value: [null, 2, null],
    unit: ["", "m", ""],
    text: Array<string>(3).fill(event.text),
  };
  const inspections: ReplayInspection[] = [
    { inspection: { body: robot(3), cycle: 20, title: "robot 3", sections: [], marks: [] }, scans: [] },
  ];
  const names = [{ key: "trips", label: "trips", unit: "" }];
  const metrics = { is: "metrics", names, first: 0, present: null, cycles: [0, 20, 30], values: [[0, 1, 2]] };
  const file: ReplayFile = {
    version: VERSION,
    program: "sidestep",
    runs: [
      {
        name: "run",
        scene: {
          name: "</script>",
          world: "robots",
          agent: "robot",
          dimensions: 2,
          cycle_s: 0.1,
          floor: null,
          bodies: [],
          groups: [],
          names: [],
          is_recording: true,
          traffic: null,
        },
        status,
        digest: "abc",
        digests: null,
        cycles: [[0, 10, 4]],
        tables: [{ part: 1, tables: 1 }],
        source: 2,
        metrics: 3,
        agents: {
          names: [{ key: "trips", label: "trips", unit: "", is_primary: true }],
          agents: 4,
          cycles: [0, 20, 30],
          parts: [7],
        },
        chunks: [{ part: 4, frames: 4 }],
        events: [{ part: 5, from: 3, until: 23, count: 3 }],
        events_left_out: 4,
        events_lost: [
          [2, 1],
          [20, 3],
        ],
        inspections: [{ part: 6, from: 20, until: 20, count: 1 }],
        inspected: "robot 3 in cycles 20 to 20",
      },
    ],
  };
  const source = { is: "source", place: "scenario.toml", text: "a = 1", read_only: true };
  const tables = { all: table, changes: [[0, 1]] };
  const parts = [file, tables, source, metrics, chunk(4), events, inspections, agentPlane()];
  const packed = parts.map((part) => (part instanceof Uint8Array ? part : Buffer.from(JSON.stringify(part))));
  return packed.map((part) => deflateRawSync(part).toString("base64")).join("\n");
}

/** The trips of four agents at three times, of which the first has none at the start. */
function agentPlane(): Uint8Array {
  const trips = [
    [NaN, 1, 2],
    [0, 3, 4],
    [0, 5, 6],
    [0, 7, 8],
  ];
  return new Uint8Array([0, ...new Uint8Array(Float32Array.from(trips.flat()).buffer)]);
}

function replayStudio(): Studio {
  return new Studio({
    open: () => new ReplaySocket(partsOf(replayText())),
    after: () => undefined,
    cancel: () => undefined,
    accessStatus: () => Promise.resolve("in"),
    isReplay: true,
  });
}

async function opened(): Promise<Studio> {
  const studio = replayStudio();
  studio.connect();
  await vi.waitUntil(() => studio.active?.frames.newest);
  return studio;
}

test("a body table is the bodies that came and have not gone", () => {
  const { all } = JSON.parse(
    inflateRawSync(Buffer.from(replayText().split("\n")[1]!, "base64")).toString(),
  ) as ReplayTablesPart;
  const three: BodyTable = {
    ...all,
    kind: [0, 0, 1],
    number: [3, 8, 0],
    part: [-1, -1, -1],
    shape: [0, 0, 1],
    appearance: [0, 0, 0],
    names: [
      [1, "AB8"],
      [2, "rope"],
    ],
    is_agent: [true, true, false],
  };
  const part = { all: three, changes: [[0, 2], [1], [0], [1, 2]] };
  expect(selectTable(part, 0, 5)).toMatchObject({ id: 5, number: [3, 0], kind: [0, 1], names: [[1, "rope"]] });
  expect(selectTable(part, 1, 6).names).toEqual(three.names);
  expect(selectTable(part, 2, 7)).toMatchObject({ number: [8, 0], is_agent: [true, false] });
  expect(selectTable(part, 2, 7).names).toEqual([
    [0, "AB8"],
    [1, "rope"],
  ]);
  expect(selectTable(part, 3, 8).number).toEqual([]);
  expect(() => selectTable(part, 4, 9)).toThrow("not whole");
});

test("a replay opens by itself and goes to recorded cycles alone", async () => {
  const studio = await opened();
  const session = studio.active!;
  expect([session.run.scene.name, session.run.lastCycle, session.folder]).toEqual(["</script>", 30, null]);
  expect(session.frames.newest?.cycle).toBe(0);
  expect(await session.playback.seekTo(27)).toBe(true);
  session.frames.credit.refill();
  expect((await session.frames.waitForCycle(20))?.positions_m[0]).toBe(2);
  session.playback.step(1);
  session.frames.credit.refill();
  expect(await session.frames.waitForCycle(30)).not.toBeNull();
  await vi.waitUntil(() => session.run.status.state === "over");
  expect(session.run.status.digest).toBe("abc");
  studio.close(session);
});

test("after a seek at once, as an address asks for, the next frame is the one that was sought", async () => {
  const studio = replayStudio();
  studio.connect();
  while (!studio.active?.client.isLive) await new Promise((then) => setImmediate(then));
  const { frames, playback } = studio.active;
  const seen: [number, boolean][] = [];
  frames.subscribe(() => seen.push([frames.newest!.cycle, frames.isAfterSeek]));
  await playback.seekTo(20);
  frames.credit.refill();
  await frames.waitForCycle(20);
  expect(seen.at(-1)).toEqual([20, true]);
});

test("trails are those of the agents that were asked for, or of all", async () => {
  const session = (await opened()).active!;
  const trailsOf = (bodies: BodyId[]) => session.client.request({ do: "trails", until: 25, bodies });
  const own = { body: robot(3), cycles: [0, 10, 20], points_m: [0, 0, 0, 1, 0, 0, 2, 0, 0] };
  expect(await trailsOf([])).toEqual({ is: "trails", trails: [own] });
  expect(await trailsOf([robot(3)])).toEqual({ is: "trails", trails: [own] });
  expect(await trailsOf([robot(4)])).toEqual({ is: "trails", trails: [] });
});

test("while somebody scrubs, a frame comes for each seek", async () => {
  const session = (await opened()).active!;
  const shown: number[] = [];
  session.frames.subscribe(() => {
    shown.push(session.frames.newest!.cycle);
    session.frames.credit.refill();
  });
  session.frames.credit.refill();
  for (const cycle of [30, 10, 20]) expect(await session.playback.seekTo(cycle)).toBe(true);
  await vi.waitUntil(() => shown.at(-1) === 20 && session.run.status.state === "paused");
  expect(session.run.status.cycle).toBe(20);
});

test("playing reaches the end, and pausing stays where it is", async () => {
  const session = (await opened()).active!;
  session.frames.subscribe(() => session.frames.credit.refill());
  session.frames.credit.refill();
  session.playback.setSpeed({ times: 10 });
  session.playback.play();
  await vi.waitUntil(() => session.run.status.state === "over");
  expect(session.run.status.cycle).toBe(30);
  await session.playback.seekTo(0);
  session.playback.pause();
  await vi.waitUntil(() => session.run.status.state === "paused");
  expect(session.run.status.cycle).toBe(0);
});

test("events, metrics, text and inspections are those of the file", async () => {
  const session = (await opened()).active!;
  const events = await session.client.request({ do: "events", from: 3, until: 31, skip: 1, limit: 1 });
  // One of the window, and three that are lost in it; another one was lost before.
  expect(events).toMatchObject({ is: "events", left_out: 4, known_until: 31 });
  if (events.is === "events") expect(events.entries).toMatchObject([{ cycle: 3, value: 2, unit: "m", body: null }]);
  const later = await session.client.request({ do: "events", from: 4, until: 31, skip: null, limit: 9 });
  if (later.is === "events") expect(later.entries).toMatchObject([{ cycle: 23, kind: "contact" }]);
  const metrics = await session.client.request({ do: "metrics", from: 1 });
  expect(metrics).toMatchObject({ first: 1, cycles: [20, 30], values: [[1, 2]] });
  expect(await session.client.source()).toMatchObject({ text: "a = 1" });
  const inspect = () => session.client.request({ do: "inspect", body: robot(3) });
  await expect(inspect()).rejects.toMatchObject({ problem: { remedy: expect.stringContaining("cycles 20 to 20") } });
  await session.playback.seekTo(20);
  expect(await inspect()).toMatchObject({ is: "inspection", title: "robot 3" });
  await expect(session.client.request({ do: "restart", seed: null, text: null })).rejects.toThrow("only shown");
});

test("a damaged file says so and opens nothing", async () => {
  const studio = new Studio({
    open: () => new ReplaySocket(partsOf("AAAA\nAAAA")),
    after: () => undefined,
    cancel: () => undefined,
    accessStatus: () => Promise.resolve("in"),
    isReplay: true,
  });
  studio.connect();
  await vi.waitUntil(() => studio.problems.length > 0);
  expect(studio.problems[0]!.problem.remedy).toBe("get the file again");
  expect(studio.sessions).toEqual([]);
});

test("links hold a cycle and an agent", () => {
  expect(parseLink("#cycle=1234&agent=8")).toEqual({ cycle: 1234, agent: "8" });
  expect(parseLink("#agent=0/17&cycle=-2")).toEqual({ cycle: null, agent: "0/17" });
  expect(formatLink({ cycle: 5, agent: "chain/0/17" })).toBe("cycle=5&agent=chain/0/17");
  expect(formatLink({ cycle: null, agent: "a&b" })).toBe("agent=a%26b");
  expect(parseLink("")).toEqual({ cycle: null, agent: null });
});

test("the cycle of a link waits for all runs, and its agent for its body, each by itself", async () => {
  const { bodies } = (await opened()).active!.frames;
  const request = new LinkRequest(parseLink("#cycle=12"));
  expect(request.takeAgent(bodies!)).toBeNull();
  expect([request.takeCycle(), request.takeCycle()]).toEqual([12, null]);
  const both = new LinkRequest(parseLink("#cycle=12&agent=3"));
  expect(both.takeAgent(bodies!)).toEqual(robot(3));
  expect([both.takeAgent(bodies!), both.takeCycle()]).toEqual([null, 12]);
  const unknown = new LinkRequest(parseLink("#agent=99"));
  expect([unknown.takeCycle(), unknown.takeAgent(bodies!)]).toEqual([null, null]);
});

test("metrics of agents are those of the last cycle that has a row, and unknown ones are told the known", async () => {
  const studio = await opened();
  const { client } = studio.active!;
  const ask = async (metric: string | null): Promise<unknown> => client.request({ do: "agent-metrics", metric });
  expect(await ask(null)).toMatchObject({ names: [{ key: "trips" }], values: [] });
  expect(await ask("trips")).toMatchObject({ cycle: 0, values: [null, 0, 0, 0] });
  await studio.active!.playback.seekTo(20);
  expect(await ask("trips")).toMatchObject({ cycle: 20, values: [1, 3, 5, 7] });
  await expect(ask("tripps")).rejects.toMatchObject({ problem: { remedy: "ask for one of trips" } });
});

test("a search goes over the events of the whole file, by words and kinds, page by page", async () => {
  const studio = await opened();
  const { client } = studio.active!;
  const find = async (text: string, kinds: string[] | null, skip = 0): Promise<unknown> =>
    client.request({ do: "find-events", text, kinds, skip, limit: 2 });
  const all = { searched: 3, left_out: 4, kinds: [["contact", 3]] };
  expect(await find("touched", null)).toMatchObject({ ...all, found: 3, entries: [{ cycle: 3 }, { cycle: 3 }] });
  expect(await find("touched", null, 2)).toMatchObject({ ...all, found: 3, entries: [{ cycle: 23 }] });
  expect(await find("ROBOT 3", ["contact"])).toMatchObject({ found: 1, entries: [{ cycle: 3, body: { number: 3 } }] });
  expect(await find("touched", [])).toMatchObject({ found: 0, entries: [] });
});
