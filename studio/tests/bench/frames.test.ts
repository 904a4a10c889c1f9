/**
 * Frames of ten thousand robots that reach the screen each second, in headless Chromium with software rendering.
 * Without STUDIO_URL the made-up server sends them; with it, a real one that runs crowd.toml as a text.
 */

import type { Browser, CDPSession, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { launch, openPage, WAIT_MS } from "../browser";
import { FakeServer } from "../fake/server";
import { openCrowd } from "./crowd";

const url = process.env.STUDIO_URL;
const MEASURED_S = 10;
const server = new FakeServer("dist");
let browser: Browser;
beforeAll(async () => {
  if (!url) await server.start();
  browser = await launch();
});
afterAll(async () => {
  await browser.close();
  if (!url) await server.stop();
});

interface Count {
  pictures: number;
  cycles: number;
  leftOut: number;
  scripting_ms: number;
  styling_ms: number;
  heap_mb: number;
  /** CPU time of each kind of process of the browser. */
  cpu_ms: Map<string, number>;
}

/** The browser's processes by kind, with the CPU time that each has used so far. */
async function cpuByProcess(browser: Browser): Promise<Map<string, number>> {
  const client = await browser.newBrowserCDPSession();
  const { processInfo } = await client.send("SystemInfo.getProcessInfo");
  await client.detach();
  const sums = new Map<string, number>();
  for (const { type, cpuTime } of processInfo) sums.set(type, (sums.get(type) ?? 0) + 1000 * cpuTime);
  return sums;
}

async function count(page: Page, client: CDPSession): Promise<Count> {
  const { metrics } = await client.send("Performance.getMetrics");
  const of = (name: string): number => metrics.find((metric) => metric.name === name)?.value ?? 0;
  const number = async (id: string): Promise<number> => {
    const found = page.getByTestId(id);
    return (await found.count()) === 0 ? 0 : Number((await found.textContent())!.replace(/\D/g, ""));
  };
  return {
    pictures: Number(await page.locator(".view").getAttribute("data-pictures")),
    cycles: await number("cycle"),
    leftOut: await number("left-out"),
    scripting_ms: 1000 * of("ScriptDuration"),
    styling_ms: 1000 * (of("LayoutDuration") + of("RecalcStyleDuration")),
    heap_mb: of("JSHeapUsedSize") / 1e6,
    cpu_ms: await cpuByProcess(browser),
  };
}

test("ten thousand robots are shown", { timeout: 4 * WAIT_MS }, async () => {
  const { page, consoleErrors } = await openPage(browser, url ?? server.url);
  await openCrowd(page, url !== undefined);
  await page.getByTestId("agent-count").filter({ hasText: "10000" }).waitFor();
  // Each robot is drawn as a body; DENSITY=1 measures the heat that is shown instead from far away.
  if (!process.env.DENSITY) {
    await page.getByRole("button", { name: "More", exact: true }).click();
    await page.getByLabel("Density").selectOption("off");
    await page.keyboard.press("Escape");
  }
  const client = await page.context().newCDPSession(page);
  await client.send("Performance.enable");
  await page.getByLabel("Speed", { exact: true }).selectOption(url ? "fastest" : "10");
  // A text that is run plays by itself.
  if (!url) await page.getByRole("button", { name: "Play", exact: true }).click();
  await expect.poll(async () => (await count(page, client)).pictures, { timeout: WAIT_MS }).toBeGreaterThan(20);
  const before = await count(page, client);
  const began = performance.now();
  await page.waitForTimeout(1000 * MEASURED_S);
  const after = await count(page, client);
  const seconds = (performance.now() - began) / 1000;
  const perSecond = (after.pictures - before.pictures) / seconds;
  const pictures = after.pictures - before.pictures;
  const script = (after.scripting_ms - before.scripting_ms) / pictures;
  const styling = (after.styling_ms - before.styling_ms) / pictures;
  const cpu = [...after.cpu_ms].map(
    ([kind, spent_ms]) => [kind, (spent_ms - (before.cpu_ms.get(kind) ?? 0)) / pictures] as const,
  );
  const cpu_ms = cpu.reduce((sum, [, own_ms]) => sum + own_ms, 0);
  console.log(
    `CPU time a frame ${cpu_ms.toFixed(1)} ms: ${cpu.map(([kind, own_ms]) => `${kind} ${own_ms.toFixed(1)}`).join(", ")}`,
  );
  console.log(
    `${perSecond.toFixed(1)} frames/s shown, ${((after.leftOut - before.leftOut) / seconds).toFixed(1)}/s left out, ` +
      `${((after.cycles - before.cycles) / seconds).toFixed(0)} cycles/s, ${script.toFixed(1)} ms of script and ${styling.toFixed(1)} of layout a frame, ` +
      `heap ${before.heap_mb.toFixed(0)} -> ${after.heap_mb.toFixed(0)} MB`,
  );
  await page.screenshot({ path: "screenshots/crowd.png" });
  expect(perSecond).toBeGreaterThan(1);
  expect(consoleErrors).toEqual([]);
});
