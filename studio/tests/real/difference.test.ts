/** The first difference of two runs of the real program. No browser is needed. */

import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { BINARY, Program, SCENARIOS } from "./program";
import { connectStudio, type StudioOfTest } from "./studio";

const connections: StudioOfTest[] = [];

describe.skipIf(BINARY === "")("the real program", () => {
  let program: Program;
  beforeAll(async () => {
    program = await Program.start(SCENARIOS);
  });
  afterAll(async () => {
    connections.forEach((one) => one.stop());
    await program?.stop();
  });

  test("two runs that differ in one key are equal before the found cycle, and differ in it", async () => {
    const connection = await connectStudio(program);
    connections.push(connection);
    const { studio } = connection;
    const path = `${SCENARIOS}/robots/crossing.toml`;
    for (let i = 0; i < 2; i++) expect(await studio.open({ kind: "scenario", path })).toBe(true);
    const [a, b] = studio.sessions as [(typeof studio.sessions)[0], (typeof studio.sessions)[0]];
    const source = await b.client.source();
    const text = source.is === "source" ? source.text : "";
    expect(await b.restart(null, `conflict_policy = "right_of_way"\n${text}`)).toBe(true);
    await studio.comparison.find(a, b);
    const cycle = Number(/from cycle (\d+) on/.exec(studio.comparison.words)?.[1]);
    expect(cycle).toBeGreaterThan(0);
    expect([a.frames.displayed.cycle, b.frames.displayed.cycle]).toEqual([cycle, cycle]);
    const digests = async (at: number): Promise<(string | null | undefined)[]> => [
      (await a.playback.digestAt(at))?.digest,
      (await b.playback.digestAt(at))?.digest,
    ];
    const [one, two] = await digests(cycle);
    expect(one).not.toBe(two);
    const [same, alike] = await digests(cycle - 1);
    expect(same).toBe(alike);
    expect(same).toEqual(expect.any(String));
  });
});
