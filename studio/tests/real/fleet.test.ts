/** A running fleet of real processes in the page: the program at SIDESTEP_BINARY, with sidestep-link in the same folder. */

import { spawn, type ChildProcess } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { createInterface } from "node:readline";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { drawn, launch, openPage, WAIT_MS } from "../browser";
import { BINARY, Program } from "./program";

const RING = `format = 1
world = "airspace"
seed = 5
[airspace]
deployment = "compact-team"
[airspace.generator]
kind = "superconflict"
n = 6
`;

/** Two chains: the numbers of connectors on the network are not those of bodies. */
const CHAINS = `format = 1
world = "chain"
seed = 3
[chain]
dt_s = 0.05
self_collision = false
backtracks = 0
escape = "off"
deployment = "team"
[[chains]]
connectors = 3
at_m = [0, 0]
rod_m = [0.3, 0.35]
count = 2
apart_m = [0.0, 1.5]
[[chains.tasks]]
kind = "wander"
within_m = [[-3, -3], [4, 3]]
patience_s = 100
`;

interface Fleet {
  process: ChildProcess;
  endpoint: string;
}

async function fly(scenario: string, ...more: string[]): Promise<Fleet> {
  const folder = mkdtempSync(join(tmpdir(), "sidestep-fleet-"));
  writeFileSync(join(folder, "s.toml"), scenario);
  const process = spawn(BINARY, ["fleet", "s.toml", "--clock", "realtime", ...more], {
    cwd: folder,
    stdio: ["ignore", "ignore", "pipe"],
  });
  const lines = createInterface({ input: process.stderr! });
  const endpoint = await new Promise<string>((resolve, reject) => {
    lines.on("line", (line) => {
      const found = /listens at (\S+)/.exec(line);
      if (found) resolve(found[1]!);
    });
    process.once("exit", (code) => reject(new Error(`the fleet ended with ${code}`)));
  });
  return { process, endpoint };
}

/** Stops a fleet in order. */
async function land({ process }: Fleet): Promise<void> {
  process.removeAllListeners("exit");
  if (process.exitCode !== null) return;
  const ended = new Promise((done) => process.once("exit", done));
  process.kill("SIGINT");
  await ended;
}

describe.skipIf(BINARY === "" || !existsSync(join(dirname(BINARY), "sidestep-link")))("fleets of processes", () => {
  let browser: Browser;
  const programs: Program[] = [];
  const fleets: Fleet[] = [];

  beforeAll(async () => {
    mkdirSync("screenshots", { recursive: true });
    browser = await launch();
  });
  afterAll(async () => {
    await browser?.close();
    for (const program of programs) await program.stop();
    for (const fleet of fleets) await land(fleet);
  });

  async function watch(
    scenario: string,
    ...more: string[]
  ): Promise<{ fleet: Fleet } & Awaited<ReturnType<typeof openPage>>> {
    const fleet = await fly(scenario, ...more);
    fleets.push(fleet);
    const program = await Program.start(fleet.endpoint);
    programs.push(program);
    const opened = await openPage(browser, program.url);
    await drawn(opened.page);
    return { fleet, ...opened };
  }

  async function cycle(page: Page): Promise<number> {
    const text = await page.getByTestId("cycle").textContent();
    return Number(text!.replace(/\D/g, ""));
  }

  async function goesOn(page: Page): Promise<void> {
    const before = await cycle(page);
    await expect.poll(() => cycle(page), { timeout: WAIT_MS }).toBeGreaterThan(before);
  }

  test("airplanes fly in the page, which lists their links", async () => {
    const { page, consoleErrors } = await watch(RING, "--speed", "4");
    await expect.poll(() => cycle(page), { timeout: WAIT_MS }).toBeGreaterThanOrEqual(2);
    await goesOn(page);
    await page
      .getByTestId("fleet")
      .filter({ hasText: /^6 nodes$/ })
      .waitFor();
    await page.locator(".fleet tbody button").nth(2).click();
    await page
      .getByTestId("node")
      .filter({ hasText: /Hears.*airplane/ })
      .waitFor();
    await page.screenshot({ path: "screenshots/real-fleet-1280.png" });
    expect(consoleErrors).toEqual([]);
    await page.context().close();
  });

  test("a connector is selected in the table, and a new fleet at the same address is opened", async () => {
    const { fleet, page, consoleErrors } = await watch(CHAINS, "--speed", "0.2", "--cycles", "1000000");
    await goesOn(page);
    await page.locator(".fleet tbody button").nth(4).click();
    const facts = page.getByTestId("node");
    await expect
      .poll(() => facts.textContent(), { timeout: WAIT_MS })
      .toMatch(/Hears connector 1\/0, connector 1\/2 Is heard by connector 1\/0, connector 1\/2/);
    await page.screenshot({ path: "screenshots/real-fleet-chains-1280.png" });
    await land(fleet);
    await page
      .getByTestId("state")
      .filter({ hasText: /finished|ended|failed/ })
      .waitFor();
    fleets.push(await fly(CHAINS, "--speed", "0.2", "--cycles", "1000000", "--listen", fleet.endpoint));
    await page.getByTestId("state").filter({ hasText: "flying" }).waitFor();
    await goesOn(page);
    expect(consoleErrors).toEqual([]);
    await page.context().close();
  });
});
