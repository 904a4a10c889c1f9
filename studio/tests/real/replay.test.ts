/** Replays in one file, from `file://` and without a network: they show what the studio shows. */

import { spawnSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { drawn, launch, openPage } from "../browser";
import { differenceOf } from "../pixels";
import { BINARY, Program, SCENARIOS } from "./program";

/** Runs of which replays are made: scenario, cycles of the run, options of the export. */
const RUNS = {
  office: { scenario: "robots/office.toml", options: ["--cycles", "300"], page: ["--agents", "1,8"] },
  superconflict: { scenario: "airspace/superconflict.toml", options: ["--cycles", "200"], page: ["--cycles", "50:60"] },
  snake: { scenario: "chain/snake3d.toml", options: ["--cycles", "60"], page: [] },
} as const;
type Run = keyof typeof RUNS;

function sidestep(...args: string[]): void {
  const { status, stderr } = spawnSync(BINARY, args, { encoding: "utf8" });
  if (status !== 0) throw new Error(`sidestep ${args.join(" ")}: ${stderr}`);
}

describe.skipIf(BINARY === "")("a replay in one file", () => {
  let browser: Browser;
  let folder: string;
  const fileOf = (run: string): string => join(folder, `${run}.html`);

  beforeAll(async () => {
    folder = mkdtempSync(join(tmpdir(), "sidestep-replay-"));
    for (const [run, { scenario, options, page }] of Object.entries(RUNS)) {
      sidestep("run", join(SCENARIOS, scenario), "--quiet", "--out", join(folder, run), ...options);
      sidestep("export", join(folder, run), "--to", "page", "--quiet", ...page);
    }
    mkdirSync("screenshots", { recursive: true });
    browser = await launch();
  });
  afterAll(async () => {
    await browser?.close();
    rmSync(folder, { recursive: true });
  });

  /** Opens a file without a network; collects what it requests beside itself. */
  async function openFile(
    run: string,
    hash = "",
    width = 1280,
  ): Promise<{ page: Page; errors: string[]; requests: string[] }> {
    const { page, consoleErrors } = await openPage(browser, "about:blank", { width });
    await page.context().setOffline(true);
    const requests: string[] = [];
    page.on("request", (request) => requests.push(request.url()));
    await page.goto(pathToFileURL(fileOf(run)).href + hash);
    await drawn(page);
    return { page, errors: consoleErrors, requests };
  }

  const shownCycle = (page: Page): Promise<number> =>
    page.evaluate(() => Number(document.querySelector("[data-testid=cycle]")!.textContent!.replace(/\D/g, "")));

  async function seek(page: Page, cycle: number): Promise<void> {
    await page.getByRole("slider", { name: "Cycle" }).fill(String(cycle), { force: true });
    await page.waitForFunction(
      (wanted) => Number(document.querySelector("[data-testid=cycle]")!.textContent!.replace(/\D/g, "")) === wanted,
      cycle,
    );
  }

  /** The picture of the view once nothing is drawn any more. */
  async function picture(page: Page): Promise<Buffer> {
    const view = page.locator(".view");
    let last = await view.screenshot();
    for (let i = 0; i < 20; i++) {
      const next = await view.screenshot();
      if (next.equals(last)) return next;
      last = next;
    }
    return last;
  }

  /** Gives the view a size of its own: around it, the studio has more buttons than a replay. */
  async function enlarge(page: Page): Promise<void> {
    await page.locator(".view").evaluate((view) => {
      const look = { position: "fixed", inset: "0", width: "1000px", height: "700px", zIndex: "10" };
      Object.assign((view as HTMLElement).style, look);
    });
  }

  for (const run of Object.keys(RUNS) as Run[]) {
    test(`${run} opens from a file, plays, and asks nothing of a network`, async () => {
      const { page, errors, requests } = await openFile(run);
      expect(await shownCycle(page)).toBe(0);
      await page.getByLabel("Speed", { exact: true }).selectOption("fastest");
      await page.getByRole("button", { name: "Play", exact: true }).click();
      await page.locator("[data-testid=state]").filter({ hasText: "finished" }).waitFor();
      // The state comes with a message of its own, which may be before the last frame is drawn.
      await expect.poll(() => shownCycle(page)).toBeGreaterThan(50);
      await page.getByText("The run has finished; digest").waitFor();
      await page.getByRole("tab", { name: "Text" }).click();
      await page.locator("pre").filter({ hasText: "format = 1" }).waitFor();
      await page.getByRole("tab", { name: "View" }).click();
      await page.locator(".chart .value").filter({ hasText: /\d/ }).first().waitFor();
      await page.screenshot({ path: `screenshots/replay-${run}-1280.png` });
      for (const name of ["Open…", "New…", "Edit", "Restart"])
        expect(await page.getByRole("button", { name }).count()).toBe(0);
      expect(requests.filter((url) => !/^(file|data|blob):/.test(url))).toEqual([]);
      expect(errors).toEqual([]);
      await page.context().close();
    });

    test(`${run} has the pixels of the studio at ten cycles`, async () => {
      const program = await Program.start(join(folder, run));
      const studio = (await openPage(browser, program.url)).page;
      await drawn(studio);
      const { page } = await openFile(run);
      await Promise.all([enlarge(studio), enlarge(page)]);
      const last = await page.getByRole("slider", { name: "Cycle" }).getAttribute("max");
      for (let k = 0; k < 10; k++) {
        const cycle = Math.floor(((k + 0.5) * Number(last)) / 10);
        await Promise.all([seek(studio, cycle), seek(page, cycle)]);
        const { pixels, largest } = await differenceOf(page, await picture(studio), await picture(page));
        expect({ cycle, pixels }).toEqual({ cycle, pixels: 0 });
        if (run === "office") expect(largest).toBe(0);
      }
      await studio.context().close();
      await page.context().close();
      await program.stop();
    });
  }

  test("an address opens a cycle and an agent, and follows what is shown", async () => {
    const { page, errors } = await openFile("office", "#cycle=120&agent=8");
    await page.locator(".inspector header").getByText("cycle 120").waitFor();
    expect(await shownCycle(page)).toBe(120);
    await page.locator(".inspector details").first().waitFor();
    await page.screenshot({ path: "screenshots/replay-office-agent-1280.png" });
    await seek(page, 200);
    await page.waitForFunction(() => location.hash === "#cycle=200&agent=8");
    await page.evaluate(() => (location.hash = "#cycle=7&agent=1"));
    await page.locator(".inspector header").getByText("cycle 7", { exact: true }).waitFor();
    expect(errors).toEqual([]);
    await page.context().close();
  });

  test("agents that were not named have no inspection, and the remedy says which have", async () => {
    const { page } = await openFile("office");
    await page.getByRole("searchbox", { name: "Filter agents" }).fill("2");
    await page.locator(".agents .row:not(.group)").first().click();
    await page.locator(".inspector p").filter({ hasText: "robots 1, 8 in all cycles" }).waitFor();
    await page.context().close();
  });

  test("events are listed, filtered, and lead to their cycles", async () => {
    const { page } = await openFile("office");
    const first = page.locator(".events").getByRole("listitem").first();
    await first.waitFor();
    await first.getByRole("button").click();
    const cycle = Number((await first.locator(".cycle").textContent())!.replace(/\D/g, ""));
    await page.waitForFunction(
      (wanted) => Number(document.querySelector("[data-testid=cycle]")!.textContent!.replace(/\D/g, "")) === wanted,
      cycle,
    );
    await page.context().close();
  });

  test("a narrow page is usable", async () => {
    const { page, errors } = await openFile("office", "#cycle=50&agent=1", 400);
    await page.getByRole("tab", { name: "inspector" }).click();
    await page.locator(".inspector details").first().waitFor();
    await page.screenshot({ path: "screenshots/replay-office-400.png" });
    expect(errors).toEqual([]);
    await page.context().close();
  });

  test("names and texts of a scenario are text, whatever they contain", async () => {
    const evil = `</script></style><script>window.isEvil = true</script><img src=x onerror="window.isEvil = true">`;
    const text = readFileSync(join(SCENARIOS, "robots/crossing.toml"), "utf8");
    const own = text.replace(/^name = .*$/m, `name = '''${evil}'''`).replace(/^description = .*$/m, "");
    expect(own).toContain(evil);
    writeFileSync(join(folder, "evil.toml"), `${own}\n# ${evil}\n`);
    sidestep("run", join(folder, "evil.toml"), "--quiet", "--cycles", "30", "--out", join(folder, "evil"));
    sidestep("export", join(folder, "evil"), "--to", "page", "--quiet");
    const html = readFileSync(fileOf("evil"), "utf8");
    expect(html).not.toContain("isEvil = true</script>");
    expect(html).not.toContain("<img");
    expect(html).not.toContain(folder);
    const { page, errors } = await openFile("evil");
    await page.getByRole("tab", { name: "Text" }).click();
    await page.locator("pre").filter({ hasText: "isEvil" }).waitFor();
    expect(await page.evaluate(() => (window as unknown as { isEvil?: boolean }).isEvil)).toBeUndefined();
    expect(await page.title()).toContain("</script>");
    expect(errors).toEqual([]);
    await page.context().close();
  });

  test("the policy of the file lets nothing out", async () => {
    const { page } = await openFile("office");
    const isRefused = await page.evaluate(async () => {
      const violations = new Set<string>();
      const all = new Promise<void>((then) =>
        document.addEventListener("securitypolicyviolation", (event) => {
          violations.add(event.effectiveDirective);
          if (violations.size === 3) then();
        }),
      );
      await fetch("https://example.org/").catch(() => undefined);
      document.body.append(Object.assign(new Image(), { src: "https://example.org/a.png" }));
      document.body.append(Object.assign(document.createElement("script"), { textContent: "window.isEvil = true" }));
      await all;
      return [...violations].sort();
    });
    expect(isRefused).toEqual(["connect-src", "img-src", "script-src-elem"]);
    await page.context().close();
  });

  test("two runs are beside each other, and their first difference is found", async () => {
    const other = join(folder, "other");
    const scenario = join(SCENARIOS, "robots/crossing.toml");
    sidestep("run", scenario, "--quiet", "--cycles", "200", "--out", join(folder, "one"));
    const changed = ["--set", "conflict_policy=right_of_way"];
    sidestep("run", scenario, "--quiet", "--cycles", "200", "--out", other, ...changed);
    sidestep("export", join(folder, "one"), "--to", "page", "--quiet", "--beside", other);
    const { page, errors } = await openFile("one");
    await page.locator(".view").nth(1).waitFor();
    await page.getByRole("button", { name: "First difference" }).click();
    await page
      .getByTestId("difference")
      .filter({ hasText: /differ from cycle \d+ on/ })
      .waitFor();
    await page.screenshot({ path: "screenshots/replay-two-1280.png" });
    expect(errors).toEqual([]);
    await page.context().close();
  });

  test("a video has the frames of the chosen cycles", async () => {
    const { page, errors } = await openFile("office");
    await page.getByRole("button", { name: "Export…" }).click();
    await page.getByLabel("from cycle").fill("20");
    await page.getByLabel("to", { exact: true }).fill("60");
    const download = page.waitForEvent("download");
    await page.getByRole("button", { name: "Video (WebM)" }).click();
    const file = await (await download).path();
    const bytes = readFileSync(file);
    expect(bytes.readUInt32BE(0)).toBe(0x1a45dfa3);
    // The policy of the file plays no videos.
    const player = await browser.newPage();
    const [duration_s, width] = await player.evaluate(
      async (url) => {
        const video = document.createElement("video");
        video.src = url;
        await new Promise((then) => (video.onloadeddata = video.onerror = then));
        return [video.duration, video.videoWidth];
      },
      `data:video/webm;base64,${bytes.toString("base64")}`,
    );
    expect(duration_s).toBeGreaterThan(1);
    expect(width).toBeGreaterThan(500);
    await player.close();
    expect(errors).toEqual([]);
    await page.context().close();
  });

  test("files stay small", () => {
    for (const run of Object.keys(RUNS)) expect(statSync(fileOf(run)).size).toBeLessThan(2_000_000);
  });
});
