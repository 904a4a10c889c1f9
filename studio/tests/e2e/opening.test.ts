/** Opening: the welcome page, what was opened before, dropped files, the focus; two runs in one chart; runs of a sweep. */

import { mkdirSync } from "node:fs";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, expect, test } from "vitest";
import { drawn, launch, LOOKS, openNew, openPage, WAIT_MS, type PageOptions } from "../browser";
import { drop as dropOn, type DropItems } from "../drop";
import { FakeServer } from "../fake/server";
import { colorsOfImages, countColors, type Color } from "../pixels";

const server = new FakeServer("dist");
let browser: Browser;
let page: Page;
let consoleErrors: string[];

beforeAll(async () => {
  mkdirSync("screenshots", { recursive: true });
  await server.start();
  browser = await launch();
});
afterAll(async () => {
  await browser.close();
  await server.stop();
});
beforeEach(() => {
  server.calls.length = 0;
  server.dropped.length = 0;
});
afterEach(async () => {
  await page.context().close();
});

async function visit(look: PageOptions = {}): Promise<void> {
  ({ page, consoleErrors } = await openPage(browser, server.url, look));
  await page.getByRole("button", { name: /^Office building/ }).waitFor();
}

const drop = (items: DropItems): Promise<void> => dropOn(page, items);

const focusedCanvas = (): Promise<string | null> =>
  page.evaluate(() => (document.activeElement?.classList.contains("picture") ? "picture" : null));

for (const [width, isDark] of LOOKS) {
  test(`the welcome page has a picture and a line of each shipped scenario, at ${width}${isDark ? ", dark" : ""}`, async () => {
    await visit({ width, isDark });
    const cards = page.locator(".card");
    expect(await cards.count()).toBe(3);
    await page.waitForFunction(() =>
      [...document.querySelectorAll<HTMLImageElement>(".card img")].every((image) => image.naturalWidth > 0),
    );
    await page.getByText("Ten thousand robots in a hall.").waitFor();
    // A picture of another shape is shown whole, within its frame.
    const outside = await page.locator(".frame").evaluateAll(
      (frames) =>
        frames.filter((frame) => {
          const [outer, inner] = [frame.getBoundingClientRect(), frame.querySelector("img")!.getBoundingClientRect()];
          return inner.bottom > outer.bottom + 0.5 || inner.right > outer.right + 0.5;
        }).length,
    );
    expect(outside).toBe(0);
    await page.screenshot({ path: `screenshots/welcome-${width}-${isDark ? "dark" : "light"}.png` });
    const overflows = await page.evaluate(() => document.documentElement.scrollWidth > innerWidth);
    expect(overflows).toBe(false);
    await page.getByRole("button", { name: /^Serpentine/ }).click();
    await drawn(page);
    expect(server.calls).toContainEqual({ do: "open", target: { kind: "shipped", name: "chain" }, seed: null });
    expect(consoleErrors).toEqual([]);
  });
}

test("what was opened is on the welcome page with its time and a picture, and can be forgotten", async () => {
  await visit();
  await page.getByRole("button", { name: /^Office building/ }).click();
  await drawn(page);
  await page.getByRole("button", { name: /^Close/ }).click();
  const recent = page.getByRole("region", { name: "Recent" });
  await recent.getByRole("button", { name: /(today|yesterday) \d\d:\d\d.*shipped: robots/s }).waitFor();
  const source = await recent.locator("img").getAttribute("src");
  expect(source).toMatch(/^data:image\/(webp|png);base64,.{500,}/);
  // The picture shows the floor: it has more than one color.
  const [colors] = await colorsOfImages(recent.locator("img"));
  expect(colors).toBeGreaterThan(3);
  await page.screenshot({ path: "screenshots/welcome-recent.png" });
  await recent.getByRole("button", { name: /^Forget/ }).focus();
  await page.keyboard.press("Enter");
  await recent.waitFor({ state: "detached" });
  expect(consoleErrors).toEqual([]);
});

test("after opening, the picture has the focus, and Space plays", async () => {
  await visit();
  await page.getByRole("button", { name: "Open…" }).click();
  await page.getByRole("button", { name: /^robots\.toml/ }).click();
  await drawn(page);
  await expect.poll(focusedCanvas, { timeout: WAIT_MS }).toBe("picture");
  await page.keyboard.press("Space");
  await page.getByRole("button", { name: "Pause" }).waitFor();
  expect(await page.getByRole("dialog").count()).toBe(0);
});

test("a picture that is shown again leaves the focus where it is", async () => {
  await visit();
  await openNew(page, "robots");
  await expect.poll(focusedCanvas, { timeout: WAIT_MS }).toBe("picture");
  await page.getByRole("button", { name: "Open…" }).click();
  await page.getByRole("button", { name: /^sweep/ }).click();
  await page.getByRole("complementary", { name: "Runs" }).waitFor();
  await page.locator(".tab .name").first().click();
  await drawn(page);
  expect(await focusedCanvas()).toBeNull();
});

test("the place to drop on goes with the pointer, whatever was removed below it", async () => {
  await visit();
  const drag = (type: string, from: string, isOut = false): Promise<void> =>
    page.evaluate(
      ({ type, from, isOut }) => {
        const transfer = new DataTransfer();
        transfer.items.add(new File(["x"], "a.toml"));
        const relatedTarget = isOut ? null : document.body;
        const event = new DragEvent(type, { bubbles: true, cancelable: true, dataTransfer: transfer, relatedTarget });
        document.querySelector(from)!.dispatchEvent(event);
      },
      { type, from, isOut },
    );
  const over = page.getByText("Drop to open");
  await drag("dragenter", "body");
  await drag("dragenter", ".card");
  await over.waitFor();
  await drag("dragleave", "body");
  await over.waitFor();
  // The card is never left: it is gone.
  await page
    .locator(".card")
    .first()
    .evaluate((card) => (card as HTMLElement).remove());
  await drag("dragleave", "body", true);
  await over.waitFor({ state: "detached" });
});

test("a dialog that is closed without a choice gives the focus back to its button", async () => {
  await visit();
  await page.getByRole("button", { name: "Open…" }).click();
  await page.keyboard.press("Escape");
  await expect.poll(() => page.evaluate(() => document.activeElement?.textContent?.trim())).toBe("Open…");
});

test("all files of all folders are found by name and words, and what is not listed is counted", async () => {
  await visit();
  await page.getByRole("button", { name: "Open…" }).click();
  await page.getByRole("button", { name: "All files" }).click();
  await page.getByText("7 more are not listed").waitFor();
  await page.getByText("sidestep sweep more/lag.sweep.toml --out sweeps/lag").waitFor();
  await page.getByText("links and joints of a robot").waitFor();
  await page.screenshot({ path: "screenshots/open-all.png" });
  await page.getByRole("searchbox", { name: "Find files in all folders" }).fill("ten thousand");
  await page.getByRole("button", { name: /^more\/crowd\.toml/ }).waitFor();
  expect(await page.getByRole("button", { name: /^robots\.toml/ }).count()).toBe(0);
  await page.getByRole("searchbox", { name: "Find files in all folders" }).fill("");
  await page.getByRole("button", { name: /^more\// }).waitFor();
  await page.getByRole("searchbox", { name: "Find files in all folders" }).fill("nothing like it");
  await page.getByText("No file has this in its name").waitFor();
});

test("a dropped scenario is handed over and opened, and is no recent file", async () => {
  await visit();
  await drop({ "robots.toml": "world = 1" });
  await drawn(page);
  expect(server.dropped.map(([path, text]) => [path.replace(/^[\d-]+/, "N"), text])).toEqual([
    ["N/robots.toml", "world = 1"],
  ]);
  expect(await focusedCanvas()).toBe("picture");
  expect(await page.evaluate(() => localStorage.getItem("sidestep.recent"))).toBeNull();
  expect(consoleErrors).toEqual([]);
});

test("a dropped folder of a run and an MCAP file are opened as recordings", async () => {
  await visit();
  await drop({ "robots.run": { "run.json": "{}", "events.parquet": "x", ".hidden": "no" }, "chain.mcap": "bytes" });
  await page
    .getByTestId("recording")
    .or(page.getByRole("button", { name: /^Close/ }).nth(1))
    .first()
    .waitFor();
  await expect.poll(() => server.calls.filter((call) => call.do === "open").length, { timeout: WAIT_MS }).toBe(2);
  const opened = server.calls.flatMap((call) => (call.do === "open" ? [call.target] : []));
  expect(opened.map((target) => target.kind)).toEqual(["recording", "recording"]);
  expect(server.dropped.map(([path]) => path.replace(/^[\d-]+/, "N"))).toEqual([
    "N/robots.run/run.json",
    "N/robots.run/events.parquet",
    "N/chain.mcap",
  ]);
});

test("files that go with a scenario are handed over before it, and are not opened", async () => {
  await visit();
  await drop({ "hall.png": "pixels", "robots.toml": "map" });
  await drawn(page);
  expect(server.dropped.map(([path]) => path.replace(/^[\d-]+/, "N"))).toEqual(["N/hall.png", "N/robots.toml"]);
  expect(server.calls.filter((call) => call.do === "identify").length).toBe(1);
});

test("a wrong file is told what would be right, and the plan of a sweep how it is run", async () => {
  await visit();
  await drop({ "notes.txt": "words" });
  await page.getByText("is nothing that the studio opens").waitFor();
  await page.getByText("choose a scenario (.toml), a map").waitFor();
  await drop({ "lag.sweep.toml": "x" });
  await page.getByText(/sidestep sweep .*lag\.sweep\.toml/).waitFor();
  await page.screenshot({ path: "screenshots/drop-wrong.png" });
});

test("two runs side by side are in one chart, with their names and values", async () => {
  await visit();
  await page.getByRole("button", { name: "robots", exact: true }).first().click();
  await drawn(page);
  await page.getByRole("button", { name: "Open…" }).click();
  await page.getByPlaceholder("as in the file").fill("2");
  await page.getByRole("button", { name: "robots", exact: true }).click();
  await page.getByRole("button", { name: "Side by side" }).click();
  await page.getByRole("button", { name: "In step" }).click();
  await page.getByRole("slider", { name: "Cycle" }).fill("400");
  const legend = page.locator(".chart").first().getByRole("list", { name: "Runs" });
  await legend.getByText(/seed 1$/).waitFor();
  await legend.getByText(/seed 2$/).waitFor();
  await expect
    .poll(async () => (await legend.locator(".number").allTextContents()).filter((text) => /\d/.test(text)).length, {
      timeout: WAIT_MS,
    })
    .toBe(2);
  // Both lines are drawn, in colors of their own.
  const lines: Color[] = [
    [0, 114, 178],
    [213, 94, 0],
  ];
  const chart = page.locator(".chart canvas").first();
  const fewest = async (): Promise<number> => Math.min(...(await countColors(page, chart, lines, 2)));
  await page.screenshot({ path: "screenshots/charts-two.png" });
  await expect.poll(fewest, { timeout: WAIT_MS }).toBeGreaterThan(20);
  await page.getByRole("button", { name: "Side by side" }).click();
  await legend.waitFor({ state: "detached" });
  expect(consoleErrors).toEqual([]);
});

test("the runs of a sweep are a table that is sorted by a click, outliers first, and opens a run", async () => {
  await visit();
  await page.getByRole("button", { name: "Open…" }).click();
  await page.getByRole("button", { name: /^sweep/ }).click();
  const runs = page.getByRole("complementary", { name: "Runs" });
  const rows = runs.getByRole("listitem");
  await rows.first().waitFor();
  expect(await rows.first().getByRole("button").getAttribute("aria-label")).toContain(
    "seed 3, contacts 90 (high outlier)",
  );
  await runs.getByText("1 outlier first").waitFor();
  await page.screenshot({ path: "screenshots/sweep-runs.png" });
  await runs.getByRole("button", { name: /^contacts/ }).click();
  await runs.getByRole("button", { name: /^contacts/ }).click();
  const values = await rows.locator(".value:nth-of-type(3)").allTextContents();
  expect(values.map((text) => text.trim())).toEqual(["11", "12", "14", "15", "16", "90 ▲", "–"]);
  await runs.getByText("4 more results are equal").waitFor();
  await runs.getByRole("button", { name: "Leave out contacts" }).click();
  await runs.getByRole("button", { name: /^0 outliers first/ }).waitFor();
  await rows.first().getByRole("button").click();
  await drawn(page);
});

test("the help shows what the server keeps, and the bounds", async () => {
  await visit();
  await openNew(page, "robots");
  await page.getByRole("button", { name: "Help" }).click();
  const table = page.locator("section", { has: page.getByRole("heading", { name: "Memory of the server" }) });
  await table.getByText(/of at most 12 sessions are open/).waitFor();
  expect(await table.locator("p").textContent()).toMatch(
    /1 of at most 12 sessions are open; the process\s+has\s+118\s*MiB/,
  );
  const rows = await table.locator("tbody tr").allTextContents();
  expect(rows.map((row) => row.replace(/\s+/g, " ").trim())[0]).toMatch(/events ?2 KiB ?40 MiB$/);
  await page.screenshot({ path: "screenshots/help-memory.png" });
});
