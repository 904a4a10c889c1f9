/** After a loss the page names its cause, and all goes on where it was, however often the server dies. */

import { beforeEach, expect, test, vi } from "vitest";
import type { Socket } from "../../src/connection";
import type { AccessStatus } from "../../src/auth";
import type { ServerMethod, SessionMethod, ServerNotification, Scene, SessionStatus } from "../../src/protocol";
import { encodeFrame } from "../fake/encode";
import { draftOf } from "../../src/edit/draft.svelte";
import { Studio } from "../../src/state/studio.svelte";

const SCENE = {
  world: "robots",
  name: "Hall",
  dimensions: 2,
  cycle_s: 0.1,
  is_recording: false,
  floor: null,
  bodies: [],
} as unknown as Scene;

function status(more: Partial<SessionStatus> = {}): SessionStatus {
  return {
    session: 1,
    state: "paused",
    cycle: 0,
    cycles_planned: 1000,
    time_s: 0,
    speed: { times: 1 },
    cycles_per_s: 0,
    seed: "7",
    digest: null,
    banner: null,
    fleet: null,
    ...more,
  };
}

/** A request as it was sent. */
type Asked = { id: number; session?: number; call: ServerMethod | SessionMethod };

/** A server's end of a socket: answers by hand. */
class Line implements Socket {
  binaryType = "";
  onopen: (() => void) | null = null;
  onclose: (() => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  readonly asked: Asked[] = [];
  send(text: string): void {
    this.asked.push(JSON.parse(text) as Asked);
  }
  close(): void {}

  greet(): void {
    this.onopen!();
    this.say({ notice: "hello", version: 2, program: "x", worlds: [], read_only: false, open: [] });
  }
  say(words: unknown): void {
    this.onmessage?.({ data: JSON.stringify(words) });
  }
  calls(what: string): Asked["call"][] {
    return this.asked.map(({ call }) => call).filter((call) => call.do === what);
  }
  /** Answers all questions of a kind that are open. */
  async answer(what: string, answer: unknown): Promise<void> {
    const found = this.asked.filter(({ call }) => call.do === what);
    for (const { id } of found)
      this.asked.splice(
        this.asked.findIndex((one) => one.id === id),
        1,
      );
    for (const { id } of found) this.say({ id, answer });
    expect(found.length, `open questions: ${what}`).toBeGreaterThan(0);
    await settled();
  }
}

const settled = (): Promise<void> =>
  vi
    .waitFor(() => Promise.resolve())
    .then(async () => {
      for (let i = 0; i < 20; i++) await Promise.resolve();
    });
const OPENED = { is: "opened", session: 1, scene: SCENE, status: status() };

let lines: Line[];
let retries: (() => void)[];
let standing: AccessStatus;
let studio: Studio;

beforeEach(async () => {
  lines = [];
  retries = [];
  standing = "silent";
  studio = new Studio({
    open: () => (lines.push(new Line()), lines.at(-1)!),
    after: (ms, then) => (ms === 6000 ? 0 : retries.push(then)),
    cancel: () => undefined,
    accessStatus: () => Promise.resolve(standing),
  });
  studio.connect();
  line().greet();
  void studio.open({ kind: "new", world: "robots" });
  await settled();
  await line().answer("open", OPENED);
});

const line = (): Line => lines.at(-1)!;
const session = () => studio.sessions[0]!;
const tell = (more: Partial<SessionStatus>): void =>
  line().say({ notice: "status", ...status(more) } satisfies ServerNotification);

function show(cycle: number): void {
  line().say({
    notice: "bodies",
    session: 1,
    id: 1,
    kinds: ["robot"],
    kind: [0],
    number: [0],
    part: [-1],
    is_agent: [true],
    names: [],
    shapes: [{ type: "sphere", radius_m: 1 }],
    shape: [0],
    appearances: [],
    appearance: [0],
  });
  const frame = encodeFrame({
    session: 1,
    tableId: 1,
    dimensions: 2,
    cycle,
    time_s: 0,
    positions_m: [0, 0],
    orientations: [0],
    lines: [],
    conditions: [0],
  });
  line().onmessage!({ data: frame });
}

async function lose(): Promise<void> {
  line().onclose!();
  await settled();
}

async function back(): Promise<void> {
  retries.at(-1)!();
  line().greet();
  await settled();
}

for (const [how, words] of [
  ["silent", /does not answer/],
  ["token", /Open the whole address/],
  ["full", /Too many pages.*Close another/],
  ["name", /does not accept this address/],
  ["in", /connection was lost/],
] as const) {
  test(`a loss where the server is "${how}" is told as that`, async () => {
    standing = how;
    await lose();
    expect(studio.banner).toMatchObject({ isBad: true, words: expect.stringMatching(words) });
  });
}

test("a run that played goes to its cycle and plays on", async () => {
  tell({ state: "playing", cycle: 345 });
  show(345);
  await lose();
  await back();
  await line().answer("open", OPENED);
  expect(line().calls("seek")).toEqual([{ do: "seek", cycle: 345 }]);
  expect(line().calls("play")).toEqual([]);
  await line().answer("seek", { is: "done" });
  expect(line().calls("play").length).toBe(1);
  expect(studio.banner).toEqual({ words: "Reconnected; reopened Hall at cycle 345.", isBad: false });
});

test("a fleet that was lost is looked for until one flies there again, or its session is closed", async () => {
  void studio.open({ kind: "fleet", path: "tcp/127.0.0.1:7600" });
  await settled();
  await line().answer("open", { ...OPENED, session: 2 });
  const fleet = studio.sessions[1]!;
  const problem = {
    place: "tcp/127.0.0.1:7600",
    line: null,
    column: null,
    end_line: null,
    end_column: null,
    key: null,
    cause: "it was not heard",
    remedy: "wait",
    is_warning: false,
  };
  line().say({ notice: "ended", session: 2, problem });
  expect(fleet.client.ended?.cause).toBe("it was not heard");
  const looked = retries.length;
  retries.at(-1)!();
  await settled();
  const { id } = line().asked.splice(
    line().asked.findIndex(({ call }) => call.do === "open"),
    1,
  )[0]!;
  line().say({ id, problem });
  await settled();
  expect([studio.problems, retries.length]).toEqual([[], looked + 1]);
  retries.at(-1)!();
  await settled();
  await line().answer("open", { ...OPENED, session: 3 });
  expect([fleet.client.ended, fleet.client.id, retries.length]).toEqual([null, 3, looked + 1]);
  line().say({ notice: "ended", session: 3, problem });
  studio.close(fleet);
  retries.at(-1)!();
  await settled();
  expect(line().calls("open")).toEqual([]);
});

test("a run that stood still stays so", async () => {
  show(20);
  await lose();
  await back();
  await line().answer("open", OPENED);
  await line().answer("seek", { is: "done" });
  expect(line().calls("play")).toEqual([]);
});

test("a server that dies while sessions are reopened is not told to be connected, and nothing is lost", async () => {
  tell({ state: "playing", cycle: 345 });
  show(345);
  await lose();
  await back();
  await line().answer("open", OPENED);
  show(3);
  await lose();
  expect(studio.banner!.isBad).toBe(true);
  expect(studio.problems).toEqual([]);
  await back();
  await line().answer("open", OPENED);
  await line().answer("seek", { is: "done" });
  expect(studio.banner).toEqual({ words: "Reconnected; reopened Hall at cycle 345.", isBad: false });
  expect([line().calls("play").length, session().client.ended]).toEqual([1, null]);
});

test("steps that follow each other faster than they are gone add up, forth and back, and none complains", async () => {
  show(100);
  for (let i = 0; i < 3; i++) session().playback.step(10);
  expect(line().calls("step")).toEqual(Array.from({ length: 3 }, () => ({ do: "step", cycles: 10 })));
  session().playback.step(-1);
  session().playback.step(-1);
  session().playback.step(10);
  expect(line().calls("seek")).toEqual([{ do: "seek", cycle: 129 }]);
  const problem = { place: "cycle 130", cause: "replaced by another request", remedy: "", is_warning: false };
  for (const { id } of line().asked.filter(({ call }) => call.do === "step")) line().say({ id, problem });
  await settled();
  await line().answer("seek", { is: "done" });
  expect(line().calls("seek")).toEqual([{ do: "seek", cycle: 138 }]);
  expect(studio.problems).toEqual([]);
});

test("a session that is closed on its way back complains of nothing, and asks for nothing more", async () => {
  show(500);
  session().selection.select({ kind: "robot", number: 0, part: null });
  session().playback.rewind();
  session().playback.seek(300);
  session().playback.seek(200);
  const closed = session();
  studio.close(closed);
  expect(line().calls("close")).toEqual([{ do: "close" }]);
  const asked = line().asked.length;
  const problem = { place: "session", cause: "the session was closed", remedy: "", is_warning: false };
  for (const { id } of line().asked.splice(0)) line().say({ id, problem });
  await new Promise((then) => setTimeout(then, 300));
  expect([asked > 0, line().asked, studio.problems, closed.playback.isMoving]).toEqual([true, [], [], false]);
});

test("a run whose states have no digests is not compared, and the reason is told", async () => {
  void studio.open({ kind: "recording", path: "r" });
  await settled();
  await line().answer("open", {
    ...OPENED,
    session: 2,
    status: status({ session: 2, banner: "Recorded by another build." }),
  });
  tell({ digest: "aa" });
  studio.inStep = true;
  studio.toggleComparison();
  await settled();
  await line().answer("seek", { is: "done" });
  expect(studio.comparison.isRunning).toBe(false);
  expect(studio.comparison.words).toBe(
    "Hall cannot be compared, as its states have no digests. Recorded by another build.",
  );
});

test("what is saved after a loss names the text that the page knows, not that of the file by now", async () => {
  const draft = draftOf(session());
  await settled();
  await line().answer("source", { is: "source", place: "s.toml", text: "a = 1", read_only: false });
  await lose();
  await back();
  await line().answer("open", OPENED);
  void draft.save(null, false);
  await settled();
  expect(line().calls("save")).toEqual([{ do: "save", text: "a = 1", to: null, base: "a = 1", overwrite: false }]);
});

test("what cannot be opened again is told, and opened the next time", async () => {
  show(5);
  await lose();
  await back();
  const { id } = line().asked.shift()!;
  line().say({ id, problem: { place: "p", line: null, column: null, cause: "gone", remedy: "", is_warning: false } });
  await settled();
  expect(studio.banner!.words).toContain("1 could not be reopened");
  expect(session().client.ended).not.toBeNull();
  await lose();
  await back();
  await line().answer("open", OPENED);
  await line().answer("seek", { is: "done" });
  expect([session().client.ended, session().seed]).toEqual([null, 7]);
});
