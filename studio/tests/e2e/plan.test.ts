/** The plan view of traffic in a real browser, against a fake server. */

import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, expect, test } from "vitest";
import { launch, openNew, openPage, WAIT_MS, type PageOptions } from "../browser";
import { FakeServer } from "../fake/server";
import { countPixels, type Channel } from "../pixels";

const RED = 0;
const BLUE = 2;

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

test("zones are drawn where separation is lost, and around the selected aircraft alone", async () => {
  await visit();
  await seek(5);
  const before = await pixels(RED);
  await seek(32);
  await expect.poll(() => pixels(RED), { timeout: WAIT_MS }).toBeGreaterThan(before + 60);
});

test("all trails are there after a seek, as the server knows them", async () => {
  await visit();
  await page.getByRole("combobox", { name: "Trails" }).selectOption("none");
  await seek(60);
  const without = await pixels(BLUE);
  await page.getByRole("combobox", { name: "Trails" }).selectOption("all");
  await expect
    .poll(() => server.calls.filter((call) => call.do === "trails").length, { timeout: WAIT_MS })
    .toBeGreaterThan(0);
  await expect.poll(() => pixels(BLUE), { timeout: WAIT_MS }).toBeGreaterThan(without + 300);
});
