/** A watched fleet in a real browser, against a fake server; and screenshots for people. */

import { mkdirSync } from "node:fs";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, expect, test } from "vitest";
import { drawn, launch, openPage, WAIT_MS, type PageOptions } from "../browser";
import { FakeServer } from "../fake/server";

const server = new FakeServer("dist");
server.open = [{ kind: "fleet", path: "tcp/127.0.0.1:7600" }];
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
});
afterEach(async () => {
  await page.context().close();
});

async function visit(look: PageOptions = {}): Promise<void> {
  ({ page, consoleErrors } = await openPage(browser, server.url, look));
  await drawn(page);
}

test("a flying fleet is shown without controls", async () => {
  await visit();
  await page.getByText("Watching a fleet at tcp/127.0.0.1:7600").waitFor();
  await page.waitForFunction(
    () => Number(document.querySelector("[data-testid=cycle]")?.textContent?.replace(/\D/g, "")) >= 1,
  );
  expect(await page.getByTestId("state").textContent()).toBe("flying");
  expect(await page.getByTestId("fleet").textContent()).toBe("8 nodes, 1 late, 1 lost");
  for (const name of ["Play", "Restart", "Edit", "Forms", "Export…"])
    expect(await page.getByRole("button", { name, exact: true }).count()).toBe(0);
  for (const key of [" ", "ArrowRight", "ArrowLeft", "b", "j", "e"]) await page.keyboard.press(key);
  const steers: readonly string[] = ["play", "pause", "step", "seek", "speed", "restart", "edit", "save"];
  const steered = server.calls.filter((call) => steers.includes(call.do));
  expect(steered).toEqual([]);
  expect(consoleErrors).toEqual([]);
});

test("a selected node lists the nodes that it hears and that hear it", async () => {
  await visit();
  await page.getByRole("button", { name: "ONE18", exact: true }).click();
  const facts = page.getByTestId("node");
  await facts.getByText("none").waitFor();
  await expect
    .poll(() => facts.textContent(), { timeout: WAIT_MS })
    .toMatch(/Hears ONE11, ONE12, ONE14.*Is heard by none/);
  await page.getByRole("button", { name: "ONE18", exact: true }).click();
  await page.getByText("Select a node to see its links.").waitFor();
});

for (const [width, isDark] of [
  [1280, false],
  [1280, true],
  [400, false],
  [400, true],
] as const) {
  test(`at ${width} pixels, ${isDark ? "dark" : "light"}, all of it can be seen`, async () => {
    await visit({ width, height: 800, isDark });
    if (width === 400) await page.getByRole("tab", { name: "nodes" }).click();
    await page.getByTestId("fleet").waitFor();
    await page.waitForFunction(
      () => Number(document.querySelector("[data-testid=cycle]")?.textContent?.replace(/\D/g, "")) >= 2,
    );
    const cut = await page.evaluate(() => document.documentElement.scrollWidth > document.documentElement.clientWidth);
    expect(cut).toBe(false);
    await page.screenshot({ path: `screenshots/fleet-${width}-${isDark ? "dark" : "light"}.png` });
    expect(consoleErrors).toEqual([]);
  });
}
