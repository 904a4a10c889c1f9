/** Opening by the real program: what it carries, all shipped files, and files that are dropped. */

import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, relative } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test, vi } from "vitest";
import { drawn, launch, LOOKS, openPage } from "../browser";
import { drop, type DropItems } from "../drop";
import { BINARY, Program, SCENARIOS } from "./program";
import { connectStudio } from "./studio";

/** All files below a folder, by their paths in it. */
function filesBelow(folder: string, of = folder): string[] {
  return readdirSync(of, { withFileTypes: true }).flatMap((entry) => {
    const path = join(of, entry.name);
    return entry.isDirectory() ? filesBelow(folder, path) : [relative(folder, path).replaceAll("\\", "/")];
  });
}

const folderItems = (folder: string): Record<string, Uint8Array> =>
  Object.fromEntries(filesBelow(folder).map((name) => [name, readFileSync(join(folder, name))]));

/** A map of MovingAI with a wall across. */
const MAP = `type octile\nheight 20\nwidth 30\nmap\n${Array.from({ length: 20 }, (_, row) => (row === 10 ? `${"@".repeat(20)}${".".repeat(10)}` : ".".repeat(30))).join("\n")}\n`;

describe.skipIf(BINARY === "")("opening by the real program", () => {
  let browser: Browser;
  let program: Program;
  let place: string;
  beforeAll(async () => {
    program = await Program.start(SCENARIOS);
    mkdirSync("screenshots", { recursive: true });
    browser = await launch();
    place = mkdtempSync(join(tmpdir(), "opening-"));
    const scenario = join(SCENARIOS, "robots/crossing.toml");
    const run = ["run", scenario, "--cycles", "60", "--quiet"];
    execFileSync(BINARY, [...run, "--out", join(place, "crossing")], { stdio: "ignore" });
    execFileSync(BINARY, ["export", join(place, "crossing"), "--to", "mcap", "--out", join(place, "crossing.mcap")], {
      stdio: "ignore",
    });
  });
  afterAll(async () => {
    await browser?.close();
    await program?.stop();
    rmSync(place, { recursive: true, force: true });
  });

  async function visit(width = 1280, isDark = false): Promise<{ page: Page; consoleErrors: string[] }> {
    const visited = await openPage(browser, program.url, { width, isDark });
    await visited.page.locator(".card").first().waitFor();
    return visited;
  }

  for (const [width, isDark] of LOOKS)
    test(`the welcome page shows what the program carries, at ${width}${isDark ? ", dark" : ""}`, async () => {
      const { page, consoleErrors } = await visit(width, isDark);
      const shipped = filesBelow(SCENARIOS).filter((name) =>
        /^(robots|chain|airspace)\/(?!default).*\.toml$/.test(name),
      );
      expect(await page.locator(".card").count()).toBe(shipped.length);
      await page.locator(".card img").last().scrollIntoViewIfNeeded();
      await page.waitForFunction(
        () =>
          [...document.querySelectorAll<HTMLImageElement>(".card img")].filter((one) => one.naturalWidth > 0).length >
          3,
      );
      await page.locator(".welcome").evaluate((welcome) => welcome.scrollTo(0, 0));
      await page.screenshot({ path: `screenshots/real-welcome-${width}-${isDark ? "dark" : "light"}.png` });
      expect(consoleErrors).toEqual([]);
      await page.context().close();
    });

  test("every scenario that the program carries is opened and steps", { timeout: 300_000 }, async () => {
    const { studio, stop } = await connectStudio(program);
    const answer = await studio.request({ do: "gallery" });
    const entries = answer.is === "gallery" ? answer.entries : [];
    expect(entries.length).toBeGreaterThan(20);
    for (const { name, title } of entries) {
      expect([name, await studio.open({ kind: "shipped", name })]).toEqual([name, true]);
      const session = studio.active!;
      expect(session.run.scene.name).toContain(title);
      session.playback.step(1);
      await vi.waitUntil(() => session.frames.cycle === 1, { timeout: 60_000 });
      studio.close(session);
    }
    expect(studio.problems).toEqual([]);
    stop();
  });

  for (const world of ["robots", "chain", "airspace"])
    test(`the first scenario of ${world} is opened by its card, and steps`, async () => {
      const { page, consoleErrors } = await visit();
      const card = page.locator(`section[aria-labelledby="gallery-${world}"] .card`).first();
      const title = await card.locator("b").textContent();
      await card.click();
      await drawn(page);
      await page.getByRole("button", { name: "One cycle forward" }).click();
      await page.waitForFunction(
        () => Number(document.querySelector("[data-testid=cycle]")?.textContent?.replace(/\D/g, "")) === 1,
      );
      expect(await page.locator(".tab.active .name").textContent()).toContain(title);
      expect(consoleErrors).toEqual([]);
      await page.context().close();
    });

  test("the list of all files has every shipped file", async () => {
    const { page } = await visit();
    await page.getByRole("button", { name: "Open…" }).click();
    await page.getByRole("button", { name: "All files" }).click();
    await page.getByRole("dialog").getByText("sidestep sweep").first().waitFor();
    const listed = await page.locator("dialog[open] li b").allTextContents();
    expect(listed.filter((name) => name.includes("/")).sort()).toEqual(filesBelow(SCENARIOS).sort());
    await page.screenshot({ path: "screenshots/real-open-all.png" });
    await page.context().close();
  });

  const opens = async (items: DropItems, name: RegExp): Promise<Page> => {
    const { page, consoleErrors } = await visit();
    await drop(page, items);
    await page.locator(".tab.active .name").filter({ hasText: name }).waitFor();
    await drawn(page);
    expect(consoleErrors).toEqual([]);
    return page;
  };

  test("a dropped scenario of the given folder is opened from there", async () => {
    const page = await opens({ "crossing.toml": readFileSync(join(SCENARIOS, "robots/crossing.toml")) }, /A crossing/);
    const stored = await page.evaluate(() => localStorage.getItem("sidestep.recent"));
    expect(stored).toContain("robots/crossing.toml");
    await page.context().close();
  });

  test("a dropped scenario from elsewhere is opened, and is in no file", async () => {
    const text = readFileSync(join(SCENARIOS, "robots/crossing.toml"), "utf8").replace("A crossing", "My crossing");
    const page = await opens({ "mine.toml": text }, /My crossing/);
    expect(await page.evaluate(() => localStorage.getItem("sidestep.recent"))).toBeNull();
    await page
      .getByRole("tab", { name: "Text" })
      .or(page.getByRole("button", { name: "Text", exact: true }))
      .first()
      .click();
    await page.getByText("mine.toml").first().waitFor();
    await page.getByRole("button", { name: "Save", exact: true }).click();
    await page.getByRole("dialog", { name: "Save as" }).waitFor();
    await page.context().close();
  });

  test("a dropped run and an MCAP file are replayed", async () => {
    const run = await opens({ crossing: folderItems(join(place, "crossing")) }, /A crossing/);
    await run.getByTestId("recording").filter({ hasText: "Computed again" }).waitFor();
    await run.context().close();
    const mcap = await opens({ "crossing.mcap": readFileSync(join(place, "crossing.mcap")) }, /A crossing/);
    await mcap.getByTestId("recording").waitFor();
    await mcap.context().close();
  });

  test("a dropped map becomes a scenario with its walls in the text", async () => {
    const page = await opens({ "hall.map": MAP }, /hall/);
    await page
      .getByTestId("check")
      .filter({ hasText: /^\s*no problems/ })
      .waitFor();
    await page.screenshot({ path: "screenshots/real-map.png" });
    await page
      .getByRole("tab", { name: "Text" })
      .or(page.getByRole("button", { name: "Text", exact: true }))
      .first()
      .click();
    await page.locator(".cm-content").getByText("####################").first().waitFor();
    expect(await page.locator(".cm-content").innerText()).not.toContain("sidestep-studio-");
    await page.context().close();
  });

  test("a wrong file is told what would be right", async () => {
    const { page } = await visit();
    await drop(page, { "words.txt": "words" });
    await page.getByText("choose a scenario (.toml), a map").waitFor();
    await drop(page, { "bad.toml": "world = = 1" });
    await page.getByText("bad.toml:1").waitFor();
    await page.context().close();
  });

  test("the server tells its memory, within the bounds", async () => {
    const page = await opens({ "crossing.toml": readFileSync(join(SCENARIOS, "robots/crossing.toml")) }, /A crossing/);
    await page.getByLabel("Speed", { exact: true }).selectOption("fastest");
    await page.getByRole("button", { name: "Play", exact: true }).click();
    await page.waitForFunction(
      () => Number(document.querySelector("[data-testid=cycle]")?.textContent?.replace(/\D/g, "")) >= 200,
    );
    interface Usage {
      stores: { session: number | null; name: string; bytes: number; max_bytes: number }[];
      resident_bytes: number;
      sessions: number;
    }
    const usage = await page.evaluate(async () => (await fetch("/usage")).json() as Promise<Usage>);
    const names = new Set(usage.stores.map(({ name }) => name));
    expect(names).toContain("checkpoints to seek to");
    expect(usage.stores.filter(({ session, bytes }) => session !== null && bytes > 0).length).toBeGreaterThan(1);
    expect(usage.stores.filter(({ bytes, max_bytes }) => bytes > max_bytes)).toEqual([]);
    expect(usage.resident_bytes).toBeGreaterThan(1 << 20);
    await page.getByRole("button", { name: "Help" }).click();
    await page.getByRole("heading", { name: "Memory of the server" }).scrollIntoViewIfNeeded();
    await page.screenshot({ path: "screenshots/real-memory.png" });
    await page.context().close();
  });
});
