/** Charts show what `sidestep run --cycles N --json` prints, whatever the way through the run. */

import { execFile } from "node:child_process";
import { promisify } from "node:util";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test, vi } from "vitest";
import { drawn, launch, openPage } from "../browser";
import { BINARY, Program, SCENARIOS } from "./program";
import { connectStudio, type StudioOfTest } from "./studio";

const run = promisify(execFile);
const CYCLES = 50;
const connections: StudioOfTest[] = [];

type Metrics = Record<string, unknown>;

/** The metrics that the command prints for a run of so many cycles. */
async function printedMetrics(file: string, cycles: number): Promise<Metrics> {
  const { stdout } = await run(BINARY, ["run", file, "--cycles", String(cycles), "--json", "--quiet"]);
  return (JSON.parse(stdout) as { metrics: Metrics }).metrics;
}

/** The number that a chart shows of a metric, by its dotted name. */
function chartValue(metrics: Metrics, key: string): number | null {
  const value = key.split(".").reduce<unknown>((at, part) => (at as Metrics | undefined)?.[part], metrics);
  if (value === undefined) return (chartValue(metrics, key.replace(/_count$/, "")) ?? null) as number | null;
  if (Array.isArray(value)) return value.length;
  return typeof value === "boolean" ? Number(value) : (value as number | null);
}

describe.skipIf(BINARY === "")("charts", () => {
  let browser: Browser;
  let program: Program;
  beforeAll(async () => {
    program = await Program.start(SCENARIOS);
    browser = await launch();
  });
  afterAll(async () => {
    connections.forEach((one) => one.stop());
    await browser?.close();
    await program?.stop();
  });

  for (const [name, end] of [
    ["robots/crossing.toml", 1000],
    ["chain/arm.toml", 200],
    ["airspace/superconflict.toml", 75],
  ] as const)
    test(`of ${name} equal the command's metrics at ${CYCLES} cycles`, { timeout: 300_000 }, async () => {
      const path = `${SCENARIOS}/${name}`;
      const connection = await connectStudio(program);
      connections.push(connection);
      const { studio } = connection;
      expect(await studio.open({ kind: "scenario", path })).toBe(true);
      const session = studio.sessions[0]!;
      session.playback.play();
      for (let k = 0; k < CYCLES; k++) {
        const cycle = Math.floor(((((k * 37) % CYCLES) + 1) * end) / CYCLES);
        expect(await session.playback.seekTo(cycle)).toBe(true);
        await vi.waitUntil(
          () => {
            session.refresh(true);
            return session.metrics.present?.cycle === cycle;
          },
          { timeout: 20_000, interval: 20 },
        );
        const printed = await printedMetrics(path, cycle);
        for (const { key } of session.metrics.names)
          expect([key, session.metrics.valueAt(key, cycle)]).toEqual([key, { cycle, value: chartValue(printed, key) }]);
      }
    });

  test("show their number and its cycle on the page", async () => {
    const { page, consoleErrors } = await openPage(browser, program.url, { width: 1280, isDark: false });
    await page.getByRole("button", { name: "Open…" }).click();
    await page.getByRole("button", { name: "robots/" }).click();
    await page.getByRole("button", { name: "office.toml" }).first().click();
    await drawn(page);
    for (const cycle of [300, 2500, 41]) {
      await page.locator("input[type=range]").first().fill(String(cycle));
      const value = page.locator(`.chart .value[data-cycle="${cycle}"]`).first();
      await value.waitFor();
      const key = await page.locator(".chart select").first().inputValue();
      const printed = await printedMetrics(`${SCENARIOS}/robots/office.toml`, cycle);
      expect([key, Number(await value.getAttribute("data-value"))]).toEqual([key, chartValue(printed, key)]);
    }
    await page.screenshot({ path: "screenshots/real-charts.png" });
    expect(consoleErrors).toEqual([]);
    await page.context().close();
  });
});
