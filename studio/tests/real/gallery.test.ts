/** The pages of a sweep, from `file://` and without a network: they show every run, and open replays. */

import { spawnSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { drawn, launch, LOOKS, openPage } from "../browser";
import { colorsOfImages } from "../pixels";
import { BINARY, SCENARIOS } from "./program";

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const EVIL = `</script><img src=x onerror="window.isEvil = true">`;

function sidestep(...args: string[]): void {
  const { status, stderr } = spawnSync(BINARY, args, { encoding: "utf8" });
  if (status !== 0) throw new Error(`sidestep ${args.join(" ")}: ${stderr}`);
}

interface Finding {
  id: string;
  nodes: { target: string[]; failureSummary: string }[];
}

describe.skipIf(BINARY === "")("the runs of a sweep as pages", () => {
  let browser: Browser;
  let folder: string;

  beforeAll(async () => {
    folder = mkdtempSync(join(tmpdir(), "sidestep-gallery-"));
    const scenario = join(SCENARIOS, "robots/crossing.toml");
    const sweep = [
      "format = 1",
      `scenario = '${scenario}'`,
      `name = '''Crossing ${EVIL}'''`,
      "replicates = 8",
      "set = { cycles = 150 }",
      `[[variant]]\nname = '''by turns ${EVIL}'''\nconflict_policy = "right_of_way"`,
      `[[variant]]\nname = "as they come"`,
    ];
    writeFileSync(join(folder, "crossing.toml"), sweep.join("\n"));
    sidestep("sweep", join(folder, "crossing.toml"), "--quiet", "--out", join(folder, "crossing"));
    sidestep("export", join(folder, "crossing"), "--to", "page", "--quiet", "--runs", "6");
    mkdirSync("screenshots", { recursive: true });
    browser = await launch();
  });
  afterAll(async () => {
    await browser?.close();
    rmSync(folder, { recursive: true });
  });

  async function openIndex(
    width = 1280,
    isDark = false,
  ): Promise<{ page: Page; errors: string[]; requests: string[] }> {
    const { page, consoleErrors } = await openPage(browser, "about:blank", { width, isDark });
    await page.context().setOffline(true);
    const requests: string[] = [];
    page.on("request", (request) => requests.push(request.url()));
    await page.goto(pathToFileURL(join(folder, "crossing-gallery/index.html")).href);
    return { page, errors: consoleErrors, requests };
  }

  for (const [width, isDark] of LOOKS) {
    test(`at ${width} pixels, ${isDark ? "dark" : "light"}, without findings of axe`, async () => {
      const { page, errors, requests } = await openIndex(width, isDark);
      expect(await page.locator(".matrix td[data-run]").count()).toBe(16);
      expect(await page.locator(".all tbody tr").count()).toBe(16);
      expect(await page.locator(".replays li img").count()).toBe(6);
      // The page itself never scrolls sideways.
      const excess = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      expect(excess).toBeLessThanOrEqual(0);
      await page.screenshot({ path: `screenshots/gallery-${width}-${isDark ? "dark" : "light"}.png`, fullPage: true });
      // The policy refuses scripts of others: axe comes as the test's own.
      await page.evaluate(AXE);
      const found = await page.evaluate(async () => {
        const { axe } = window as unknown as { axe: { run(): Promise<{ violations: Finding[] }> } };
        return (await axe.run()).violations;
      });
      expect(found.map(({ id, nodes }) => `${id}: ${nodes.map((n) => n.target.join(" ")).join("; ")}`)).toEqual([]);
      expect(await page.evaluate(() => (window as unknown as { isEvil?: boolean }).isEvil)).toBeUndefined();
      expect(requests.filter((url) => !/^(file|data|blob):/.test(url))).toEqual([]);
      expect(errors).toEqual([]);
      await page.context().close();
    });
  }

  test("a metric is chosen for the matrix, with its own values and outliers", async () => {
    const { page } = await openIndex();
    const select = page.getByLabel("Metric");
    const names = await select.locator("option").allTextContents();
    expect(names.length).toBeGreaterThan(2);
    const heads = await page.locator(".all thead th").allTextContents();
    for (const name of names.slice(0, 4)) {
      await select.selectOption({ label: name });
      const column = heads.indexOf(name) + 1;
      const cells = page.locator(`.all tbody tr > :nth-child(${column})`);
      const texts = (all: string[]): string[] => all.map((text) => text.replace(/[^\w.+-]/g, "")).sort();
      const shown = await page.locator(".matrix td[data-run]").locator("a, .value").allTextContents();
      expect(texts(shown)).toEqual(texts(await cells.allTextContents()));
      const marks = (await page.locator(".matrix td .mark").allTextContents()).filter((mark) => /[▲▼]/.test(mark));
      const marked = (await cells.allTextContents()).filter((text) => /[▲▼]/.test(text));
      expect(marks.length).toBe(marked.length);
    }
    await page.context().close();
  });

  test("runs are sorted by any column, and filtered", async () => {
    const { page } = await openIndex();
    const seeds = (): Promise<number[]> =>
      page.locator(".all tbody tr > :nth-child(2)").evaluateAll((cells) => cells.map((one) => Number(one.textContent)));
    await page.locator(".all thead button").nth(1).click();
    const rising = await seeds();
    expect(rising).toEqual([...rising].sort((a, b) => a - b));
    await page.locator(".all thead button").nth(1).click();
    expect(await seeds()).toEqual([...rising].reverse());
    await page.getByLabel("with a replay").check();
    expect(await page.locator(".all tbody tr:visible").count()).toBe(6);
    await page.getByLabel("outliers", { exact: true }).check();
    const outliers = await page.locator(".all tbody tr[data-outlier]").count();
    expect(outliers).toBeGreaterThan(0);
    expect(await page.locator(".all tbody tr:visible").count()).toBe(outliers);
    await page.context().close();
  });

  test("a run opens its replay, which says what it is, and comes back", async () => {
    const { page, errors, requests } = await openIndex();
    await page.locator(".replays li a").first().click();
    await page.waitForURL(/runs\/\d{6}\.html/);
    await drawn(page);
    await page.getByRole("button", { name: /A crossing \(.*seed \d+/ }).waitFor();
    await page.screenshot({ path: "screenshots/gallery-replay-1280.png" });
    await page.goBack();
    await page.locator(".matrix a").first().click();
    await page.waitForURL(/runs\/\d{6}\.html/);
    expect(requests.filter((url) => !/^(file|data|blob):/.test(url))).toEqual([]);
    expect(errors).toEqual([]);
    await page.context().close();
  });

  test("pictures of runs show something", async () => {
    const { page } = await openIndex();
    const colors = await colorsOfImages(page.locator(".replays img"));
    expect(colors.length).toBe(6);
    for (const count of colors) expect(count).toBeGreaterThan(3);
    await page.context().close();
  });
});
