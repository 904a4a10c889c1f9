/** The plan view of traffic in a real browser, against a fake server. */

import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, expect, test } from "vitest";
import { launch, openNew, openPage, WAIT_MS, type PageOptions } from "../browser";
import { FakeServer } from "../fake/server";
import { airplanes } from "../fake/scenes";
import { countColors, countPixels, type Channel, type Color } from "../pixels";
import { paletteOf, visibleColor } from "../../src/scene/palette";

const RED = 0;
const BLUE = 2;
/** Of the zone of an aircraft without conflict, from 0 to 255. */
const ZONE_OPACITY = 0x12;

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
beforeEach(() => {
  server.calls.length = 0;
});
afterEach(async () => {
  await page.context().close();
});

async function visit(look: PageOptions = {}): Promise<void> {
  ({ page, consoleErrors } = await openPage(browser, server.url, look));
  await openNew(page, "airspace");
}

async function seek(cycle: number): Promise<void> {
  await page.getByRole("slider", { name: "Cycle" }).fill(String(cycle));
  await page
    .getByTestId("cycle")
    .filter({ hasText: String(cycle) })
    .waitFor();
}

async function settle(): Promise<void> {
  await page.evaluate(() => new Promise((then) => requestAnimationFrame(() => requestAnimationFrame(then))));
}

const view = (): ReturnType<Page["locator"]> => page.locator(".view");
const pixels = (channel: Channel): Promise<number> => countPixels(page, view(), channel);

test("traffic is shown from above with a data block for each aircraft, and areas are filled", async () => {
  await visit();
  await seek(5);
  await expect.poll(() => view().getAttribute("data-blocks"), { timeout: WAIT_MS }).toBe("8");
  // The area and its hatches alone are 8,000 pixels.
  expect(await pixels(BLUE)).toBeGreaterThan(2000);
  expect(await page.getByRole("button", { name: "3-D" }).count()).toBe(0);
  expect(consoleErrors).toEqual([]);
});

const trailCalls = () => server.calls.flatMap((call) => (call.do === "trails" ? [call] : []));
const chooseTrails = (mode: string) => page.getByRole("combobox", { name: "Trails" }).selectOption(mode);

/** Selects an aircraft by its name. */
const select = (name: string) => page.locator(".agents").getByText(name, { exact: true }).click();

/** The color of the zone of an aircraft, as it shines on the ground. */
function zoneColor(index: number): Color {
  const { table } = airplanes();
  const light = paletteOf(false);
  const color = visibleColor(table.appearances[table.appearance[index]!]![0].color, light);
  const [r, g, b] = [0, 1, 2].map((k) => light.free[k]! + (ZONE_OPACITY / 255) * (color[k]! - light.free[k]!));
  return [Math.round(r!), Math.round(g!), Math.round(b!)];
}

test("zones are drawn where separation is lost", async () => {
  await visit();
  await seek(5);
  const before = await pixels(RED);
  await seek(32);
  await expect.poll(() => pixels(RED), { timeout: WAIT_MS }).toBeGreaterThan(before + 60);
});

test("the zone of the selected aircraft is drawn, and no other one", async () => {
  await visit();
  await seek(5);
  const colors = [zoneColor(0), zoneColor(1)];
  const zones = () => countColors(page, view(), colors, 1);
  const [ownBefore, otherBefore] = await zones();
  await select("ONE11");
  await expect.poll(async () => (await zones())[0], { timeout: WAIT_MS }).toBeGreaterThan(ownBefore! + 40);
  expect((await zones())[1]).toBeLessThan(otherBefore! + 20);
});

test("all trails are there after a seek, are asked for once, and go on while it plays", async () => {
  await visit();
  await chooseTrails("all");
  await seek(60);
  await expect.poll(() => trailCalls().map(({ until }) => until), { timeout: WAIT_MS }).toEqual([60]);
  expect(trailCalls()[0]!.bodies).toEqual([]);
  await chooseTrails("none");
  await settle();
  const without = await pixels(BLUE);
  await chooseTrails("all");
  await expect.poll(() => pixels(BLUE), { timeout: WAIT_MS }).toBeGreaterThan(without + 300);
  await seek(30);
  await expect.poll(() => pixels(BLUE), { timeout: WAIT_MS }).toBeGreaterThan(without + 100);
  await page.getByRole("button", { name: "Play", exact: true }).click();
  await page.waitForFunction(() => Number(document.querySelector("[data-testid=cycle]")!.textContent) > 40);
  await page.getByRole("button", { name: "Pause", exact: true }).click();
  expect(trailCalls().length).toBe(1);
  expect(await pixels(BLUE)).toBeGreaterThan(without + 100);
});

test("trails are asked for of the selected aircraft alone, where only its trail is shown", async () => {
  await visit();
  await chooseTrails("selected");
  await seek(60);
  await settle();
  expect(trailCalls()).toEqual([]);
  await select("ONE12");
  const body = { kind: "airplane", number: 1, part: null };
  await expect.poll(trailCalls, { timeout: WAIT_MS }).toMatchObject([{ until: 60, bodies: [body] }]);
});
