/** Images and videos of the view, in a real browser against a fake server: what is in them, and their names. */

import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, expect, test } from "vitest";
import { drawn, launch, openNew, openPage, WAIT_MS } from "../browser";
import { FakeServer } from "../fake/server";
import { countColors, readImage, type Color } from "../pixels";
import { framesOf, meanDifference, picturesOf } from "../webm";

/** Where the legend of an image is, at twice the size. */
const LEGEND = { width_px: 600, height_px: 200 };
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
afterEach(async () => {
  await page.context().close();
});

async function visit(world: string, width = 1280): Promise<void> {
  ({ page, consoleErrors } = await openPage(browser, server.url, { width }));
  await openNew(page, world);
  await drawn(page);
}

async function seek(cycle: number): Promise<void> {
  await page.getByRole("slider", { name: "Cycle" }).fill(String(cycle));
  await page.waitForFunction(
    (wanted) => Number(document.querySelector("[data-testid=cycle]")!.textContent!.replace(/\D/g, "")) === wanted,
    cycle,
  );
}

/** Saves something of the export dialog; the file's name and its bytes. */
async function save(button: string): Promise<{ name: string; bytes: Buffer }> {
  const download = page.waitForEvent("download");
  await page.getByRole("button", { name: button }).click();
  const file = await download;
  return { name: file.suggestedFilename(), bytes: readFileSync((await file.path())!) };
}

/** The colors of the legend that the page shows. */
function legendColors(): Promise<Color[]> {
  return page
    .locator(".legend .swatch")
    .evaluateAll((swatches) =>
      swatches.map((one) => getComputedStyle(one).borderTopColor.match(/\d+/g)!.slice(0, 3).map(Number)),
    ) as unknown as Promise<Color[]>;
}

for (const width of [1280, 400]) {
  test(`an image has twice the size, with the legend, at ${width} pixels`, async () => {
    await visit("robots", width);
    await seek(300);
    const size = await page.locator(".view").evaluate((view) => [view.clientWidth, view.clientHeight]);
    const canvas = (): Promise<number[]> =>
      page.locator("canvas.picture").evaluate((one: HTMLCanvasElement) => [one.width, one.height]);
    const before = await canvas();
    await page.getByRole("button", { name: "Export…" }).click();
    const plain = (await save("Image (PNG)")).bytes;
    await page.keyboard.press("Escape");
    await page.locator(".agents").getByRole("treeitem", { name: "courier Anna" }).click();
    await page.locator(".legend").waitFor({ state: "attached" });
    const colors = await legendColors();
    expect(colors.length).toBeGreaterThan(1);
    await page.getByRole("button", { name: "Export…" }).click();
    const { name, bytes } = await save("Image (PNG)");
    writeFileSync(`screenshots/image-${width}.png`, bytes);
    const without = await readImage(page, plain, colors, LEGEND);
    const image = await readImage(page, bytes, colors, LEGEND);
    expect(name).toMatch(/^[\w.-]+-300\.png$/);
    expect([image.width, image.height]).toEqual(size.map((side) => 2 * side));
    expect(image.colors).toBeGreaterThan(20);
    image.counts.forEach((count, k) => expect(count).toBeGreaterThan(without.counts[k]! + 20));
    expect(await canvas()).toEqual(before);
    expect(consoleErrors).toEqual([]);
  });
}

/** Number of pixels of an image near a color, within a part of it. */
function countInImage(bytes: Buffer, color: Color, part?: { x: number; y: number; width: number; height: number }) {
  return page.evaluate(
    async ({ url, color: [r, g, b], part }) => {
      const image = new Image();
      image.src = url;
      await image.decode();
      const { x, y, width, height } = part ?? { x: 0, y: 0, width: image.width, height: image.height };
      const pen = Object.assign(document.createElement("canvas"), { width, height }).getContext("2d")!;
      pen.drawImage(image, -x, -y);
      const { data } = pen.getImageData(0, 0, width, height);
      let count = 0;
      for (let i = 0; i < data.length; i += 4)
        if (Math.max(Math.abs(data[i]! - r), Math.abs(data[i + 1]! - g), Math.abs(data[i + 2]! - b)) <= 6) count++;
      return count;
    },
    { url: `data:image/png;base64,${bytes.toString("base64")}`, color, part },
  );
}

const COURIERS: Color = [0, 114, 178];
const GUARDS: Color = [213, 94, 0];
const chooseColors = (colors: string) => page.getByLabel("Colors", { exact: true }).first().selectOption(colors);

test("an image has the legend of colors where the page has it", async () => {
  await visit("robots");
  await chooseColors("group");
  const legend = page.getByRole("region", { name: "Colors" });
  await legend.getByText("couriers").waitFor();
  const [box, view] = [(await legend.boundingBox())!, (await page.locator(".view").boundingBox())!];
  const part = {
    x: Math.round(2 * (box.x - view.x)),
    y: Math.round(2 * (box.y - view.y)),
    width: Math.round(2 * box.width),
    height: Math.round(2 * box.height),
  };
  await page.getByRole("button", { name: "Export…" }).click();
  const { bytes } = await save("Image (PNG)");
  writeFileSync("screenshots/image-colors.png", bytes);
  // A swatch has 11 x 11 pixels of the page.
  for (const color of [COURIERS, GUARDS]) expect(await countInImage(bytes, color, part)).toBeGreaterThan(400);
});

test("robots of a crowd are as large in an image as on the page", { timeout: 4 * WAIT_MS }, async () => {
  await visit("crowd");
  await page.getByRole("button", { name: "More", exact: true }).click();
  await page.getByLabel("Density").selectOption("off");
  await page.keyboard.press("Escape");
  await chooseColors("group");
  await page.getByRole("region", { name: "Colors" }).getByText("3334").waitFor();
  await page.evaluate(() => new Promise((then) => requestAnimationFrame(() => requestAnimationFrame(then))));
  const [onPage] = await countColors(page, page.locator(".view"), [COURIERS]);
  await page.getByRole("button", { name: "Export…" }).click();
  const inImage = await countInImage((await save("Image (PNG)")).bytes, COURIERS);
  // Twice the size each way.
  expect(inImage / onPage!).toBeGreaterThan(3);
});

test("a video of a run that goes on has each of its frames, and shows their cycles", async () => {
  await visit("robots");
  await page.getByLabel("Speed", { exact: true }).selectOption("10");
  await page.getByRole("button", { name: "Export…" }).click();
  await page.getByLabel("from cycle").fill("20");
  await page.getByLabel("to", { exact: true }).fill("160");
  const { name, bytes } = await save("Video (WebM)");
  expect(name).toMatch(/^[\w.-]+-20-160\.webm$/);
  const words = await page.getByText(/at the speed of the transport/).textContent();
  const frames = framesOf(bytes);
  const { width, height, duration_s, pictures } = await picturesOf(browser, bytes, [0, 1e6], 160);
  expect(frames, words!).toBe(Math.round(30 * duration_s));
  expect(frames).toBeGreaterThan(20);
  expect([width % 2, height % 2]).toEqual([0, 0]);
  expect(new Set(pictures[0]).size).toBeGreaterThan(5);
  // The robots have moved between the first and the last frame.
  const moved = meanDifference(pictures[0]!, pictures[1]!);
  expect(moved).toBeGreaterThan(0.05);
  // The last frame is what the page shows at the last cycle.
  await seek(160);
  const view = await save("Image (PNG)");
  const shown = await page.evaluate(
    async ([url, small, high]) => {
      const image = new Image();
      image.src = url;
      await image.decode();
      const canvas = Object.assign(document.createElement("canvas"), { width: small, height: high });
      const pen = canvas.getContext("2d")!;
      pen.drawImage(image, 0, 0, small, high);
      return [...pen.getImageData(0, 0, small, high).data];
    },
    [`data:image/png;base64,${view.bytes.toString("base64")}`, 160, Math.round((160 * height) / width)] as const,
  );
  expect(meanDifference(pictures[1]!, shown)).toBeLessThan(6);
  expect(meanDifference(pictures[1]!, shown)).toBeLessThan(meanDifference(pictures[0]!, shown));
  expect(consoleErrors).toEqual([]);
});
