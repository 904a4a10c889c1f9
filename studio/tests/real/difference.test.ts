/** The first difference of two runs of a real server: STUDIO_URL names one that serves `scenarios`. No browser is needed. */

import { afterAll, expect, test, vi } from "vitest";
import { WebSocket } from "ws";
import type { Socket } from "../../src/connection";
import { Studio } from "../../src/state/studio.svelte";

const url = process.env.STUDIO_URL ?? "";
const timers: ReturnType<typeof setInterval>[] = [];
afterAll(() => timers.forEach(clearInterval));

async function connected(): Promise<Studio> {
  const studio = new Studio({
    open: () => new WebSocket(`${url.replace(/^http/, "ws")}socket`) as unknown as Socket,
    after: (ms, then) => setTimeout(then, ms),
    cancel: (timer) => clearTimeout(timer as NodeJS.Timeout),
    standing: () => Promise.resolve("in"),
  });
  studio.connect();
  await vi.waitUntil(() => studio.isConnected, { timeout: 20_000 });
  timers.push(setInterval(() => studio.sessions.forEach((one) => one.grantUnseen()), 50));
  return studio;
}

test.skipIf(url === "")("two runs that one key tells apart are alike before the cycle that is found, and not in it", async () => {
  const studio = await connected();
  const path = "scenarios/robots/crossing.toml";
  for (let i = 0; i < 2; i++) expect(await studio.open({ kind: "scenario", path })).toBe(true);
  const [a, b] = studio.sessions as [(typeof studio.sessions)[0], (typeof studio.sessions)[0]];
  const source = await b.source();
  const text = source.is === "source" ? source.text : "";
  expect(await b.restart(null, `conflict_policy = "right_of_way"\n${text}`)).toBe(true);
  await studio.comparison.find(a, b);
  console.log(studio.comparison.words);
  const cycle = Number(/from cycle (\d+) on/.exec(studio.comparison.words)?.[1]);
  expect(cycle).toBeGreaterThan(0);
  expect([a.shown.cycle, b.shown.cycle]).toEqual([cycle, cycle]);
  const digests = async (at: number): Promise<(string | undefined)[]> => [(await a.digestAt(at))?.digest, (await b.digestAt(at))?.digest];
  const [one, two] = await digests(cycle);
  expect(one).not.toBe(two);
  const [same, alike] = await digests(cycle - 1);
  expect(same).toBe(alike);
  expect(same).toBeDefined();
});
