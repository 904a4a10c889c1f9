/**
 * Memory of server and page over a long play of ten thousand robots. STUDIO_URL names a real server and STUDIO_PID its
 * process, MINUTES how long it is played (60), SPEED how fast (`fastest`, which fills the server's keyframes up to their
 * bound at once); skipped without them.
 */

import { readFileSync } from "node:fs";
import type { Browser, CDPSession } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { launch, openPage, WAIT_MS } from "../browser";
import { openCrowd } from "./crowd";

const { STUDIO_URL: url = "", STUDIO_PID: pid = "", SPEED: speed = "fastest" } = process.env;
const minutes = Number(process.env.MINUTES ?? "60");
/** Caches may fill until then. */
const SETTLED = 1 / 12;
const MAX_GROWTH = 1.1;

function server_mb(): number {
  const status = readFileSync(`/proc/${pid}/status`, "utf8");
  return Number(/VmRSS:\s+(\d+) kB/.exec(status)![1]) / 1e3;
}

/** Returns the used part of the page's heap, without garbage. */
async function page_mb(client: CDPSession): Promise<number> {
  await client.send("HeapProfiler.collectGarbage");
  const { metrics } = await client.send("Performance.getMetrics");
  return metrics.find((metric) => metric.name === "JSHeapUsedSize")!.value / 1e6;
}

describe.skipIf(url === "" || pid === "")("a real server", () => {
  let browser: Browser;
  beforeAll(async () => {
    browser = await launch();
  });
  afterAll(async () => browser.close());

  test("memory does not grow over time", { timeout: 60_000 * minutes + 2 * WAIT_MS }, async () => {
    const { page, consoleErrors } = await openPage(browser, url);
    await openCrowd(page, true);
    const client = await page.context().newCDPSession(page);
    await client.send("Performance.enable");
    await page.getByLabel("Speed", { exact: true }).selectOption(speed);
    const measure = async (after: number): Promise<[number, number, string | null]> => {
      await page.waitForTimeout(60_000 * minutes * after);
      return [server_mb(), await page_mb(client), await page.getByTestId("cycle").textContent()];
    };
    const early = await measure(SETTLED);
    const late = await measure(1 - SETTLED);
    const summary = ([server, heap, cycle]: [number, number, string | null]): string =>
      `server ${server.toFixed(0)} MB, heap ${heap.toFixed(1)} MB at cycle ${cycle}`;
    console.log(`after ${minutes * SETTLED} minutes ${summary(early)}; after ${minutes} ${summary(late)}`);
    expect(late[0] / early[0]).toBeLessThanOrEqual(MAX_GROWTH);
    expect(late[1] / early[1]).toBeLessThanOrEqual(MAX_GROWTH);
    expect(consoleErrors).toEqual([]);
  });
});
