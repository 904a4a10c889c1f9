/** Commands of playback, and the requests that result from them. */

import { expect, test } from "vitest";
import { makeProblem } from "../../src/connection";
import type { Scene, SessionStatus } from "../../src/protocol";
import { Frames } from "../../src/state/frames.svelte";
import { Playback } from "../../src/state/playback.svelte";
import { RunState } from "../../src/state/run-state.svelte";
import { SessionClient } from "../../src/state/session-client.svelte";
import { FakeHost, settled } from "./host";

const DONE = { is: "done" } as const;

function openPlayback(status: Partial<SessionStatus> = {}, canSeek = true) {
  const host = new FakeHost();
  const client = new SessionClient(host);
  client.id = 1;
  const run = new RunState();
  const full = { state: "paused", cycle: 0, cycles_planned: 1000, seed: "7", digest: null, ...status };
  run.onStart({ cycle_s: 0.1 } as Scene, full as SessionStatus);
  const frames = new Frames(client, { isAfterSeek: () => false, onShown: () => undefined });
  return { playback: new Playback(client, run, frames, canSeek), run, host };
}

test("a new speed reaches the server only while the run plays", () => {
  const paused = openPlayback();
  paused.playback.setSpeed({ times: 4 });
  expect(paused.host.pending).toEqual([]);
  paused.playback.play();
  expect(paused.host.calls("play")).toEqual([{ do: "play", speed: { times: 4 } }]);
  const playing = openPlayback({ state: "playing" });
  playing.playback.setSpeed("fastest");
  expect(playing.host.calls("play")).toEqual([{ do: "play", speed: "fastest" }]);
});

test("a seek stays within the run, and a fleet is not sought", () => {
  const { playback, host } = openPlayback();
  playback.seek(5000);
  expect(host.calls("seek")).toEqual([{ do: "seek", cycle: 1000 }]);
  const fleet = openPlayback({}, false);
  fleet.playback.seek(5);
  expect(fleet.host.pending).toEqual([]);
});

test("a seek that a newer command replaced is no problem, and any other refused one is", async () => {
  const { playback, host } = openPlayback();
  const problem = makeProblem("cycle 5", "replaced by another request", "");
  playback.seek(5);
  playback.play();
  await host.refuse("seek", problem);
  expect(host.problems).toEqual([]);
  playback.seek(6);
  await host.refuse("seek", problem);
  expect(host.problems).toEqual([problem]);
});

test("a step backwards is a seek", () => {
  const { playback, host } = openPlayback();
  playback.step(10);
  expect(host.calls("step")).toEqual([{ do: "step", cycles: 10 }]);
  playback.step(-4);
  expect(host.calls("seek")).toEqual([{ do: "seek", cycle: 6 }]);
});

test("a digest is that of the cycle once the run is paused there", async () => {
  const { playback, run, host } = openPlayback({ state: "seeking" });
  const digest = playback.digestAt(9);
  await host.reply("seek", DONE);
  run.status = { ...run.status, cycle: 9 };
  playback.onStatus();
  run.status = { ...run.status, state: "paused", digest: "ab" };
  playback.onStatus();
  expect(await digest).toEqual({ cycle: 9, digest: "ab" });
});

test("canceled waits for a digest yield none", async () => {
  const { playback, host } = openPlayback({ state: "seeking" });
  const digest = playback.digestAt(9);
  await host.reply("seek", DONE);
  playback.cancel();
  await settled();
  expect(await digest).toBeNull();
});
