/** Requests of a session, and which of their failures are reported. */

import { expect, test } from "vitest";
import { CONNECTION_LOST, makeProblem } from "../../src/connection";
import { SessionClient } from "../../src/state/session-client.svelte";
import { FakeHost } from "./host";

function openClient(): { client: SessionClient; host: FakeHost } {
  const host = new FakeHost();
  const client = new SessionClient(host);
  client.id = 1;
  return { client, host };
}

test("a session without an id sends nothing, and reports nothing", async () => {
  const { client, host } = openClient();
  client.id = 0;
  expect(await client.send({ do: "pause" })).toBeNull();
  expect(client.isLive).toBe(false);
  expect(host.pending).toEqual([]);
  expect(host.problems).toEqual([]);
});

test("a refused request is reported", async () => {
  const { client, host } = openClient();
  const answer = client.send({ do: "pause" });
  const problem = makeProblem("session", "it cannot be paused", "wait");
  await host.refuse("pause", problem);
  expect(await answer).toBeNull();
  expect(host.problems).toEqual([problem]);
});

test("a lost connection and a quiet request are not reported", async () => {
  const { client, host } = openClient();
  void client.send({ do: "pause" });
  await host.refuse("pause", CONNECTION_LOST);
  client.sendQuietly({ do: "credit", frames: 1 });
  await host.refuse("credit", makeProblem("session", "it has ended", "open it again"));
  expect(host.problems).toEqual([]);
});

test("a session that has ended on the server is not live", () => {
  const { client } = openClient();
  expect(client.isLive).toBe(true);
  client.ended = makeProblem("session", "it failed", "restart it");
  expect(client.isLive).toBe(false);
});

test("a problem is mended once a request of the same method succeeds", async () => {
  const host = new FakeHost();
  const mended: string[] = [];
  Object.assign(host, { onMended: (problem: { cause: string }) => mended.push(problem.cause) });
  const client = new SessionClient(host);
  client.id = 1;
  const refused = client.send({ do: "restart", seed: null, text: "seed = [" });
  await host.refuse("restart", makeProblem("s.toml", "the list is not closed", "close it"));
  expect(await refused).toBe(null);
  void client.send({ do: "pause" });
  await host.reply("pause", { is: "done" });
  expect([host.problems.length, mended]).toEqual([1, []]);
  void client.send({ do: "restart", seed: null, text: "seed = 1" });
  await host.reply("restart", { is: "done" });
  expect(mended).toEqual(["the list is not closed"]);
  client.mend("restart");
  expect(mended.length).toBe(1);
});
