/**
 * Seconds from the start of the program to the first picture of the scenario that it was started with, in headless
 * Chromium that runs already, and to the first answer of the server. SIDESTEP_BINARY names the program; skipped without.
 */

import type { Browser } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { drawn, launch, openPage } from "../browser";
import { BINARY, Program, SCENARIOS } from "../real/program";

const BAR_S = 2;
const TIMES = 5;

describe.skipIf(BINARY === "")("the real program", () => {
  let browser: Browser;
  beforeAll(async () => {
    browser = await launch();
  });
  afterAll(async () => browser?.close());

  async function once(scenario: string): Promise<[number, number]> {
    const began = performance.now();
    const program = await Program.start(scenario);
    try {
      const listening = performance.now();
      const { page, consoleErrors } = await openPage(browser, program.url);
      await drawn(page);
      const shown = performance.now();
      expect(consoleErrors).toEqual([]);
      await page.context().close();
      return [(listening - began) / 1000, (shown - began) / 1000];
    } finally {
      await program.stop();
    }
  }

  for (const name of ["robots/office.toml", "chain/arm.toml", "airspace/superconflict.toml"]) {
    test(`${name} is shown soon after the start`, async () => {
      const all: [number, number][] = [];
      for (let i = 0; i < TIMES; i++) all.push(await once(`${SCENARIOS}/${name}`));
      const middle = (of: 0 | 1): number => all.map((times) => times[of]).sort((a, b) => a - b)[Math.floor(TIMES / 2)]!;
      // A time is measured here, not required: it is that of the machine, too.
      console.log(
        `${name}: listening after ${middle(0).toFixed(2)} s, first picture after ${middle(1).toFixed(2)} s (median of ${TIMES}; bar ${BAR_S} s)`,
      );
    });
  }
});
