/** Screenshots for people, in `screenshots/`: three worlds, two widths, dark and light. */

import { mkdirSync } from "node:fs";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { drawn, launch, openNew, openPage } from "../browser";
import { FakeServer } from "../fake/server";

const server = new FakeServer("dist");
let browser: Browser;
beforeAll(async () => {
  mkdirSync("screenshots", { recursive: true });
  await server.start();
  browser = await launch();
});
afterAll(async () => {
  await browser.close();
  await server.stop();
});

for (const world of ["robots", "chain", "airspace"]) {
  for (const [width, height] of [
    [1280, 800],
    [400, 800],
  ] as const) {
    for (const isDark of [false, true]) {
      test(`${world} at ${width} pixels, ${isDark ? "dark" : "light"}, is drawn without errors`, async () => {
        const { page, consoleErrors } = await openPage(browser, server.url, { width, height, isDark });
        await openNew(page, world);
        await page.getByLabel("Speed", { exact: true }).selectOption("fastest");
        await page.getByRole("button", { name: "Play", exact: true }).click();
        await page.waitForFunction(
          () => Number(document.querySelector("[data-testid=cycle]")?.textContent?.replace(/\D/g, "")) >= 12,
        );
        await page.getByRole("button", { name: "Pause" }).click();
        await page.locator(".agents .row:not(.group)").nth(3).click();
        if (width === 400) await page.getByRole("tab", { name: "inspector" }).click();
        await page.locator("details").first().waitFor();
        await drawn(page);
        if (width === 1280) await page.locator(".chart .value").filter({ hasText: /\d/ }).first().waitFor();
        await page.getByRole("list", { name: "Marks" }).waitFor();
        await page.screenshot({ path: `screenshots/${world}-${width}-${isDark ? "dark" : "light"}.png` });
        expect(consoleErrors).toEqual([]);
        await page.context().close();
      });
    }
  }
}
