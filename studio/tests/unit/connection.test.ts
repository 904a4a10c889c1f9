/** A connection that breaks is made again, later and later; calls that were open fail and say why. */

import { beforeEach, expect, test } from "vitest";
import { delayBefore_ms } from "../../src/backoff";
import { Connection, RequestError, type Socket } from "../../src/connection";
import { VERSION, type ServerNotification } from "../../src/protocol";

class FakeSocket implements Socket {
  binaryType = "";
  onopen: (() => void) | null = null;
  onclose: (() => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  sent: string[] = [];
  isClosed = false;
  send(text: string): void {
    this.sent.push(text);
  }
  close(): void {
    this.isClosed = true;
  }
}

let sockets: FakeSocket[];
/** Timers that were not canceled, without those that wait for a greeting. */
let timers: { ms: number; then: () => void }[];
let greetings: { ms: number; then: () => void }[];
let heard: (ServerNotification | string)[];
let connection: Connection;

beforeEach(() => {
  sockets = [];
  timers = [];
  greetings = [];
  heard = [];
  connection = new Connection(
    {
      onNotification: (notice) => heard.push(notice),
      onFrame: (bytes) => heard.push(`frame ${bytes.byteLength}`),
      onLost: (n) => heard.push(`lost ${n}`),
      onProblem: ({ cause }) => heard.push(`problem ${cause}`),
    },
    {
      open: () => {
        sockets.push(new FakeSocket());
        return sockets.at(-1)!;
      },
      after: (ms, then) => (ms === 6000 ? greetings : timers).push({ ms, then }),
      cancel: () => undefined,
    },
  );
  connection.connect();
});

const HELLO = JSON.stringify({
  notice: "hello",
  version: VERSION,
  program: "x",
  worlds: [],
  read_only: false,
  open: [],
});

test("waits double from a quarter of a second up to eight seconds", () => {
  expect([0, 1, 2, 3, 4, 5, 6, 50].map(delayBefore_ms)).toEqual([250, 500, 1000, 2000, 4000, 8000, 8000, 8000]);
});

test("each attempt waits longer, and a hello resets the delay", () => {
  for (let i = 0; i < 3; i++) {
    sockets.at(-1)!.onclose!();
    timers.at(-1)!.then();
  }
  expect(timers.map(({ ms }) => ms)).toEqual([250, 500, 1000]);
  expect(heard).toEqual(["lost 1", "lost 2", "lost 3"]);
  sockets.at(-1)!.onmessage!({ data: HELLO });
  sockets.at(-1)!.onclose!();
  expect(timers.at(-1)!.ms).toBe(250);
});

test("a socket without a hello is abandoned", () => {
  sockets[0]!.onopen!();
  greetings[0]!.then();
  expect([sockets[0]!.isClosed, heard]).toEqual([true, ["lost 1"]]);
  timers[0]!.then();
  greetings[0]!.then();
  expect(heard).toEqual(["lost 1"]);
});

test("replies are matched with their requests, also out of order", async () => {
  const socket = sockets[0]!;
  socket.onopen!();
  const first = connection.requestSession(1, { do: "pause" });
  const second = connection.requestSession(1, { do: "source" });
  expect(JSON.parse(socket.sent[1]!)).toEqual({ id: 2, session: 1, call: { do: "source" } });
  socket.onmessage!({
    data: JSON.stringify({ id: 2, answer: { is: "source", place: "p", text: "t", read_only: false } }),
  });
  socket.onmessage!({ data: JSON.stringify({ id: 1, answer: { is: "done" } }) });
  expect((await first).is).toBe("done");
  expect((await second).is).toBe("source");
});

test("a refused request has place, cause and remedy", async () => {
  sockets[0]!.onopen!();
  const call = connection.requestSession(9, { do: "pause" });
  const problem = {
    place: "session 9",
    line: null,
    column: null,
    end_line: null,
    end_column: null,
    key: null,
    cause: "none such",
    remedy: "open it",
    is_warning: false,
  };
  sockets[0]!.onmessage!({ data: JSON.stringify({ id: 1, problem }) });
  await expect(call).rejects.toMatchObject({ problem });
});

test("pending requests fail when the socket closes, and so do requests without a socket", async () => {
  sockets[0]!.onopen!();
  const call = connection.requestSession(1, { do: "pause" });
  sockets[0]!.onclose!();
  await expect(call).rejects.toBeInstanceOf(RequestError);
  await expect(connection.requestSession(1, { do: "pause" })).rejects.toBeInstanceOf(RequestError);
});

test("connecting now abandons the old socket, whose end is not reported as a loss", () => {
  const old = sockets[0]!;
  connection.connect();
  expect([old.isClosed, old.onclose]).toEqual([true, null]);
  expect(heard).toEqual([]);
});

test("a problem of an unknown request is reported", () => {
  const problem = { place: "request", cause: "it cannot be read", remedy: "" };
  sockets[0]!.onmessage!({ data: JSON.stringify({ id: 0, problem }) });
  expect(heard).toEqual(["problem it cannot be read"]);
});

test("bytes are frames", () => {
  sockets[0]!.onmessage!({ data: new ArrayBuffer(8) });
  expect(heard).toEqual(["frame 8"]);
});
