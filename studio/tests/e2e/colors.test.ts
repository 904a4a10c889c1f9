/** Colors of bodies and their legend, many bodies as a density, groups of agents, and events found by words. */

import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, describe, expect, test } from "vitest";
import { launch, openNew, openPage, WAIT_MS, type PageOptions } from "../browser";
import { FakeServer } from "../fake/server";
import { countColors, type Color } from "../pixels";

/** The colors of the first two groups. */
const COURIERS: Color = [0, 114, 178];
const GUARDS: Color = [213, 94, 0];
/** Walls over a density. */
const WALL: Color = [28, 32, 38];

const server = new FakeServer("dist");
let browser: Browser;
let page: Page;
let consoleErrors: string[];

beforeAll(async () => {
  await server.start();
  browser = await launch();
});
afterAll(async () => {
  await browser.close();
  await server.stop();
});
afterEach(async () => {
  expect(consoleErrors).toEqual([]);
  await page.context().close();
});

async function visit(world: string, look: PageOptions = {}): Promise<void> {
  ({ page, consoleErrors } = await openPage(browser, server.url, look));
  await openNew(page, world);
}

const legend = () => page.getByRole("region", { name: "Colors" });
const picture = () => page.locator(".view");
const choose = (colors: string) => page.getByLabel("Colors", { exact: true }).first().selectOption(colors);

async function settle(): Promise<void> {
  await page.evaluate(() => new Promise((then) => requestAnimationFrame(() => requestAnimationFrame(then))));
}

describe("colors", () => {
  test("groups are drawn in the colors of the legend, and their own colors come back", async () => {
    await visit("robots");
    await choose("group");
    await legend().getByText("couriers").waitFor();
    await legend().getByText("guards").waitFor();
    await settle();
    const [couriers, guards] = await countColors(page, picture(), [COURIERS, GUARDS]);
    // Beyond the swatches of the legend.
    expect(couriers).toBeGreaterThan(300);
    expect(guards).toBeGreaterThan(couriers!);
    await choose("own");
    await legend().waitFor({ state: "detached" });
  });

  test("a metric of agents is asked for only while it is a color, and its scale has its ends", async () => {
    await visit("robots");
    await page.getByRole("slider", { name: "Cycle" }).fill("400");
    const asked = (): number =>
      server.calls.filter((call) => call.do === "agent-metrics" && call.metric === "trips").length;
    await page.getByLabel("Colors", { exact: true }).locator("option", { hasText: "trips completed" }).waitFor({
      state: "attached",
    });
    expect(asked()).toBe(0);
    await choose("metric:trips");
    // The agent with the most trips has nine at each tenth cycle.
    await legend().getByText("at cycle 400").waitFor();
    await legend().getByText("400", { exact: true }).waitFor();
    expect(await legend().locator(".ends span").allTextContents()).toEqual(["0", "200", "400"]);
    expect(asked()).toBeGreaterThan(0);
    await choose("metric:trip_cycles_mean");
    await legend().getByText("no value").waitFor();
    await legend().getByText(", cycles").waitFor();
  });

  test("speeds have a scale in meters per second once the run has moved", async () => {
    await visit("robots");
    await choose("speed");
    await legend().getByText("no value").waitFor();
    await page.getByLabel("Speed", { exact: true }).selectOption("10");
    await page.getByRole("button", { name: "Play", exact: true }).click();
    await legend().getByText("no value").waitFor({ state: "detached" });
    await legend().getByText(", m/s").waitFor();
    const ends = await legend().locator(".ends span").allTextContents();
    expect(Number(ends.at(-1))).toBeGreaterThan(0);
  });
});

describe("a crowd", () => {
  test(
    "is a density from far away, under visible walls, and bodies when asked for",
    { timeout: 4 * WAIT_MS },
    async () => {
      await visit("crowd");
      await legend().getByText("Density").waitFor();
      await legend().getByText("robots in a cell").waitFor();
      await settle();
      // Words are as dark as walls.
      const words = page.locator("canvas.words, section.colors");
      const show = (visibility: string) =>
        words.evaluateAll((all, to) => all.forEach((one) => ((one as HTMLElement).style.visibility = to)), visibility);
      await show("hidden");
      const [walls, , alarms] = await countColors(page, picture(), [WALL, COURIERS, [208, 16, 16]], 30);
      expect(walls).toBeGreaterThan(1000);
      expect(alarms).toBe(0);
      await show("visible");
      await page.getByRole("button", { name: "More", exact: true }).click();
      await page.getByLabel("Density").selectOption("off");
      await legend().waitFor({ state: "detached" });
      await page.keyboard.press("Escape");
      await choose("group");
      await legend().getByText("3334").waitFor();
      await settle();
      // Each of ten thousand robots covers some pixels of its own.
      const [couriers, guards] = await countColors(page, picture(), [COURIERS, GUARDS]);
      expect(couriers).toBeGreaterThan(3334 * 4);
      expect(guards).toBeGreaterThan(6666 * 4);
    },
  );

  test("is bodies again from near", { timeout: 4 * WAIT_MS }, async () => {
    await visit("crowd");
    await legend().getByText("Density").waitFor();
    await page.locator("canvas.picture").hover();
    for (let i = 0; i < 6; i++) await page.mouse.wheel(0, -400);
    await legend().waitFor({ state: "detached" });
  });
});

describe("agents", () => {
  test("are listed by groups with counts, which fold, and are found by a group's name", async () => {
    await visit("robots");
    const tree = page.getByRole("tree", { name: "Agents" });
    const heading = tree.getByRole("treeitem", { name: /couriers/ });
    expect(await heading.textContent()).toMatch(/couriers\s*8/);
    await tree.getByRole("treeitem", { name: "courier Anna" }).waitFor();
    await heading.click();
    expect(await heading.getAttribute("aria-expanded")).toBe("false");
    await tree.getByRole("treeitem", { name: "courier Anna" }).waitFor({ state: "detached" });
    await page.getByLabel("Filter agents").fill("guard 12");
    await tree.getByRole("treeitem", { name: "robot 12" }).waitFor();
    expect(await page.getByTestId("agent-count").textContent()).toContain("1 of 24");
  });
});

describe("events", () => {
  test("are found by words over the whole run", async () => {
    await visit("robots");
    await page.getByRole("slider", { name: "Cycle" }).fill("2000");
    await page.getByTestId("event-count").filter({ hasText: /\d\d/ }).waitFor();
    await page.getByLabel("Search events").fill("southern corridor");
    await page.getByTestId("event-count").filter({ hasText: /found/ }).waitFor();
    const rows = page.locator(".events .row");
    expect(await rows.count()).toBeGreaterThan(3);
    for (const text of await rows.allTextContents()) expect(text).toContain("southern corridor");
    await page.getByLabel("Search events").fill("no such words");
    await page.getByText("No event has all these words.").waitFor();
    await page.getByLabel("Search events").press("Escape");
    await page
      .getByTestId("event-count")
      .filter({ hasText: /^\s*\d+\s*$/ })
      .waitFor();
  });
});

describe("side by side", () => {
  test("the pictures of two runs are moved together, and their first difference is beside the timeline", async () => {
    await visit("robots");
    await page.getByRole("button", { name: "Open…" }).click();
    const dialog = page.getByRole("dialog", { name: "Open" });
    await dialog.getByRole("textbox", { name: "Seed" }).fill("2");
    await dialog.getByRole("button", { name: "robots", exact: true }).click();
    await page.getByRole("button", { name: "Side by side" }).click();
    await page.waitForFunction(() => document.querySelectorAll("canvas.picture").length === 2);
    await page.getByLabel("Transport").getByRole("button", { name: "First difference" }).waitFor();
    const views = page.locator(".view");
    const pictures = async (k: number): Promise<Buffer> => views.nth(k).locator("canvas.words").screenshot();
    await page.waitForFunction(() =>
      [...document.querySelectorAll<HTMLElement>(".view")].every((view) => Number(view.dataset.pictures ?? 0) > 1),
    );
    const [first, second] = [await pictures(0), await pictures(1)];
    const box = (await views.nth(0).boundingBox())!;
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.wheel(0, -600);
    await settle();
    await expect.poll(async () => (await pictures(0)).equals(first)).toBe(false);
    await expect.poll(async () => (await pictures(1)).equals(second)).toBe(false);
  });
});

describe("layout", () => {
  test("the tools of the view have one row at 1280 pixels", async () => {
    await visit("crowd");
    await choose("group");
    const tools = (await page.locator(".tools").first().boundingBox())!;
    expect(tools.height).toBeLessThan(44);
  });

  test("a problem does not move the picture, and goes once it is mended", async () => {
    await visit("robots");
    const before = await picture().boundingBox();
    await page.getByRole("tab", { name: "Text" }).click();
    const text = page.getByRole("textbox", { name: "Text of the scenario" });
    await text.click();
    await page.keyboard.press("Control+End");
    await page.keyboard.type("\nkoount = 3");
    await page.getByRole("button", { name: "Run", exact: true }).click();
    const problems = page.locator(".problems");
    await problems.locator("*").first().waitFor();
    const bar = (await page.getByRole("toolbar", { name: "Editing" }).boundingBox())!;
    await text.click();
    await page.keyboard.press("Control+z");
    await page.getByTestId("check").filter({ hasText: "no problems" }).waitFor();
    await expect.poll(async () => problems.locator("*").count()).toBe(0);
    expect((await page.getByRole("toolbar", { name: "Editing" }).boundingBox())!.y).toBe(bar.y);
    await page.getByRole("tab", { name: "View" }).click();
    expect((await picture().boundingBox())!.y).toBe(before!.y);
  });
});
