/** A running fleet of real processes in the page. SIDESTEP_BINARY names the program; sidestep-link lies beside it. */

import { spawn, type ChildProcess } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { createInterface } from "node:readline";
import type { Browser } from "playwright-core";
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

describe.skipIf(BINARY === "" || !existsSync(join(dirname(BINARY), "sidestep-link")))("a fleet of processes", () => {
  let browser: Browser;
  let program: Program;
  let fleet: ChildProcess;

  beforeAll(async () => {
    const folder = mkdtempSync(join(tmpdir(), "sidestep-fleet-"));
    writeFileSync(join(folder, "ring.toml"), RING);
    fleet = spawn(BINARY, ["fleet", "ring.toml", "--clock", "realtime", "--speed", "4"], { cwd: folder, stdio: ["ignore", "ignore", "pipe"] });
    const lines = createInterface({ input: fleet.stderr! });
    const endpoint = await new Promise<string>((told, failed) => {
      lines.on("line", (line) => {
        const found = /listens at (\S+)/.exec(line);
        if (found) told(found[1]!);
      });
      fleet.once("exit", (code) => failed(new Error(`the fleet ended with ${code}`)));
    });
    program = await Program.start(endpoint);
    mkdirSync("screenshots", { recursive: true });
    browser = await launch();
  });
  afterAll(async () => {
    await browser?.close();
    await program?.stop();
    fleet?.removeAllListeners("exit");
    fleet?.kill("SIGINT");
  });

  test("flies in the page, and says who hears whom", async () => {
    const { page, complaints } = await openPage(browser, program.url);
    await drawn(page);
    const cycle = (): Promise<number> => page.getByTestId("cycle").textContent().then((text) => Number(text!.replace(/\D/g, "")));
    await expect.poll(cycle, { timeout: WAIT_MS }).toBeGreaterThanOrEqual(2);
    const before = await cycle();
    await expect.poll(cycle, { timeout: WAIT_MS }).toBeGreaterThan(before);
    await page.getByTestId("fleet").filter({ hasText: /^6 nodes$/ }).waitFor();
    await page.locator(".fleet tbody button").nth(2).click();
    await page.getByTestId("node").filter({ hasText: /Hears.*airplane|Hears/ }).waitFor();
    await page.screenshot({ path: "screenshots/real-fleet-1280.png" });
    expect(complaints).toEqual([]);
    await page.context().close();
  });
});
