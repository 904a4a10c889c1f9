/** After a lost connection the page reports its cause and restores all sessions, however often the server stops. */

import { beforeEach, expect, test, vi } from "vitest";
import type { Socket } from "../../src/connection";
import type { AccessStatus } from "../../src/auth";
import {
  VERSION,
  type ServerMethod,
  type SessionMethod,
  type ServerNotification,
  type Scene,
  type SessionStatus,
} from "../../src/protocol";
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

/** A sent request. */
type SentRequest = { id: number; session?: number; call: ServerMethod | SessionMethod };

/** The server's end of a socket, which tests reply through. */
class FakeSocket implements Socket {
  binaryType = "";
  onopen: (() => void) | null = null;
  onclose: (() => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  readonly sent: SentRequest[] = [];
  send(text: string): void {
    this.sent.push(JSON.parse(text) as SentRequest);
  }
  close(): void {}

  greet(): void {
    this.onopen!();
    this.sendToPage({ notice: "hello", version: VERSION, program: "x", worlds: [], read_only: false, open: [] });
  }
  sendToPage(words: unknown): void {
    this.onmessage?.({ data: JSON.stringify(words) });
  }
  calls(what: string): SentRequest["call"][] {
    return this.sent.map(({ call }) => call).filter((call) => call.do === what);
  }
  /** Replies to all open requests of a kind. */
  async answer(what: string, answer: unknown): Promise<void> {
    const found = this.sent.filter(({ call }) => call.do === what);
    for (const { id } of found)
      this.sent.splice(
        this.sent.findIndex((one) => one.id === id),
        1,
      );
    for (const { id } of found) this.sendToPage({ id, answer });
    expect(found.length, `open requests: ${what}`).toBeGreaterThan(0);
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

let sockets: FakeSocket[];
let retries: (() => void)[];
let access: AccessStatus;
let studio: Studio;

beforeEach(async () => {
  sockets = [];
  retries = [];
  access = "silent";
  studio = new Studio({
    open: () => (sockets.push(new FakeSocket()), sockets.at(-1)!),
    after: (ms, then) => (ms === 6000 ? 0 : retries.push(then)),
    cancel: () => undefined,
    accessStatus: () => Promise.resolve(access),
  });
  studio.connect();
  socket().greet();
  void studio.open({ kind: "new", world: "robots" });
  await settled();
  await socket().answer("open", OPENED);
});

const socket = (): FakeSocket => sockets.at(-1)!;
const session = () => studio.sessions[0]!;
const sendStatus = (more: Partial<SessionStatus>): void =>
  socket().sendToPage({ notice: "status", ...status(more) } satisfies ServerNotification);

function show(cycle: number): void {
  socket().sendToPage({
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
  socket().onmessage!({ data: frame });
}

async function lose(): Promise<void> {
  socket().onclose!();
  await settled();
}

async function back(): Promise<void> {
  retries.at(-1)!();
  socket().greet();
  await settled();
}

for (const [how, words] of [
  ["silent", /does not answer/],
  ["token", /Open the whole address/],
  ["full", /Too many pages.*Close another/],
  ["name", /does not accept this address/],
  ["in", /connection was lost/],
] as const) {
  test(`a loss where the access status is "${how}" is reported as such`, async () => {
    access = how;
    await lose();
    expect(studio.banner).toMatchObject({ isBad: true, words: expect.stringMatching(words) });
  });
}

test("a run that was playing is sought to its cycle and plays again", async () => {
  sendStatus({ state: "playing", cycle: 345 });
  show(345);
  await lose();
  await back();
  await socket().answer("open", OPENED);
  expect(socket().calls("seek")).toEqual([{ do: "seek", cycle: 345 }]);
  expect(socket().calls("play")).toEqual([]);
  await socket().answer("seek", { is: "done" });
  expect(socket().calls("play").length).toBe(1);
  expect(studio.banner).toEqual({ words: "Reconnected; reopened Hall at cycle 345.", isBad: false });
});

test("a lost fleet is reopened once there is one at its address, unless its session is closed", async () => {
  void studio.open({ kind: "fleet", path: "tcp/127.0.0.1:7600" });
  await settled();
  await socket().answer("open", { ...OPENED, session: 2 });
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
  socket().sendToPage({ notice: "ended", session: 2, problem });
  expect(fleet.client.ended?.cause).toBe("it was not heard");
  const looked = retries.length;
  retries.at(-1)!();
  await settled();
  const { id } = socket().sent.splice(
    socket().sent.findIndex(({ call }) => call.do === "open"),
    1,
  )[0]!;
  socket().sendToPage({ id, problem });
  await settled();
  expect([studio.problems, retries.length]).toEqual([[], looked + 1]);
  retries.at(-1)!();
  await settled();
  await socket().answer("open", { ...OPENED, session: 3 });
  expect([fleet.client.ended, fleet.client.id, retries.length]).toEqual([null, 3, looked + 1]);
  socket().sendToPage({ notice: "ended", session: 3, problem });
  studio.close(fleet);
  retries.at(-1)!();
  await settled();
  expect(socket().calls("open")).toEqual([]);
});

test("a run that was paused stays paused", async () => {
  show(20);
  await lose();
  await back();
  await socket().answer("open", OPENED);
  await socket().answer("seek", { is: "done" });
  expect(socket().calls("play")).toEqual([]);
});

test("a server that stops while sessions are reopened does not count as connected, and no state is lost", async () => {
  sendStatus({ state: "playing", cycle: 345 });
  show(345);
  await lose();
  await back();
  await socket().answer("open", OPENED);
  show(3);
  await lose();
  expect(studio.banner!.isBad).toBe(true);
  expect(studio.problems).toEqual([]);
  await back();
  await socket().answer("open", OPENED);
  await socket().answer("seek", { is: "done" });
  expect(studio.banner).toEqual({ words: "Reconnected; reopened Hall at cycle 345.", isBad: false });
  expect([socket().calls("play").length, session().client.ended]).toEqual([1, null]);
});

test("steps requested faster than they complete add up, forward and backward, without problems", async () => {
  show(100);
  for (let i = 0; i < 3; i++) session().playback.step(10);
  expect(socket().calls("step")).toEqual(Array.from({ length: 3 }, () => ({ do: "step", cycles: 10 })));
  session().playback.step(-1);
  session().playback.step(-1);
  session().playback.step(10);
  expect(socket().calls("seek")).toEqual([{ do: "seek", cycle: 129 }]);
  const problem = { place: "cycle 130", cause: "replaced by another request", remedy: "", is_warning: false };
  for (const { id } of socket().sent.filter(({ call }) => call.do === "step")) socket().sendToPage({ id, problem });
  await settled();
  await socket().answer("seek", { is: "done" });
  expect(socket().calls("seek")).toEqual([{ do: "seek", cycle: 138 }]);
  expect(studio.problems).toEqual([]);
});

test("a session that is closed while rewinding reports nothing and requests nothing more", async () => {
  vi.useFakeTimers();
  show(500);
  session().selection.select({ kind: "robot", number: 0, part: null });
  session().playback.rewind();
  session().playback.seek(300);
  session().playback.seek(200);
  const closed = session();
  studio.close(closed);
  expect(socket().calls("close")).toEqual([{ do: "close" }]);
  const sent = socket().sent.length;
  const problem = { place: "session", cause: "the session was closed", remedy: "", is_warning: false };
  for (const { id } of socket().sent.splice(0)) socket().sendToPage({ id, problem });
  await vi.advanceTimersByTimeAsync(300);
  vi.useRealTimers();
  expect([sent > 0, socket().sent, studio.problems, closed.playback.isMoving]).toEqual([true, [], [], false]);
});

test("a run whose states have no digests is not compared, and the reason is reported", async () => {
  void studio.open({ kind: "recording", path: "r" });
  await settled();
  await socket().answer("open", {
    ...OPENED,
    session: 2,
    status: status({ session: 2, banner: "Recorded by another build." }),
  });
  sendStatus({ digest: "aa" });
  studio.inStep = true;
  studio.toggleComparison();
  await settled();
  await socket().answer("seek", { is: "done" });
  expect(studio.comparison.isRunning).toBe(false);
  expect(studio.comparison.words).toBe(
    "Hall cannot be compared, as its states have no digests. Recorded by another build.",
  );
});

test("saving after a loss compares with the text that the page knows, not with the file's current one", async () => {
  const draft = draftOf(session());
  await settled();
  await socket().answer("source", { is: "source", place: "s.toml", text: "a = 1", read_only: false });
  await lose();
  await back();
  await socket().answer("open", OPENED);
  void draft.save(null, false);
  await settled();
  expect(socket().calls("save")).toEqual([{ do: "save", text: "a = 1", to: null, base: "a = 1", overwrite: false }]);
});

test("a session that cannot be reopened is reported, and reopened the next time", async () => {
  show(5);
  await lose();
  await back();
  const { id } = socket().sent.shift()!;
  socket().sendToPage({
    id,
    problem: { place: "p", line: null, column: null, cause: "gone", remedy: "", is_warning: false },
  });
  await settled();
  expect(studio.banner!.words).toContain("1 could not be reopened");
  expect(session().client.ended).not.toBeNull();
  await lose();
  await back();
  await socket().answer("open", OPENED);
  await socket().answer("seek", { is: "done" });
  expect([session().client.ended, session().seed]).toEqual([null, 7]);
});
