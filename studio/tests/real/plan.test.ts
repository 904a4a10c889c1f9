/** Air traffic in plan view, by the real program. */

import { mkdirSync } from "node:fs";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { drawn, launch, openPage, WAIT_MS } from "../browser";
import { countPixels } from "../pixels";
import { BINARY, Program, SCENARIOS } from "./program";

/** Screenshots for people; MANY=1 for all scenarios, widths and themes. */
const LOOKS = process.env.MANY
  ? ([
      [1280, false],
      [1280, true],
      [400, false],
      [400, true],
    ] as const)
  : ([[1280, false]] as const);
const FILES = process.env.MANY
  ? ["departures.toml", "superconflict.toml", "areas.toml", "surveillance.toml", "levels-and-speeds.toml"]
  : ["departures.toml"];

describe.skipIf(BINARY === "")("the real program", () => {
  let browser: Browser;
  let program: Program;
  beforeAll(async () => {
    program = await Program.start(SCENARIOS);
    mkdirSync("screenshots", { recursive: true });
    browser = await launch();
  });
  afterAll(async () => {
    await browser?.close();
    await program?.stop();
  });

  async function open(name: string, width: number, isDark: boolean): Promise<Page> {
    const { page } = await openPage(browser, program.url, { width, isDark });
    await page.getByRole("button", { name: "Open…" }).click();
    await page.getByRole("button", { name: "airspace/" }).click();
    await page.getByRole("button", { name }).first().click();
    await drawn(page);
    return page;
  }

  async function seek(page: Page, cycle: number): Promise<void> {
    await page.getByRole("slider", { name: "Cycle" }).fill(String(cycle));
    await page.getByTestId("state").filter({ hasText: "paused" }).waitFor();
    const shown = page.getByTestId("cycle");
    await expect
      .poll(async () => (await shown.textContent())!.replace(/\D/g, ""), { timeout: WAIT_MS })
      .toBe(`${cycle}`);
  }

  for (const name of FILES) {
    for (const [width, isDark] of LOOKS) {
      test(`${name} at ${width}${isDark ? ", dark" : ""} has data blocks, and trails after a seek`, async () => {
        const page = await open(name, width, isDark);
        const view = page.locator(".view");
        await page.getByRole("combobox", { name: "Trails" }).selectOption("none");
        await seek(page, 40);
        await expect
          .poll(async () => Number(await view.getAttribute("data-blocks")), { timeout: WAIT_MS })
          .toBeGreaterThan(1);
        const without = await countPixels(page, view, 2);
        await page.getByRole("combobox", { name: "Trails" }).selectOption("all");
        await expect.poll(() => countPixels(page, view, 2), { timeout: WAIT_MS }).toBeGreaterThan(without + 50);
        if (width === 1280) await page.locator(".agents").getByRole("option").nth(1).click();
        if (width === 1280) await page.locator(".inspector details").first().waitFor();
        await page.screenshot({ path: `screenshots/plan-${name}-${width}${isDark ? "-dark" : ""}.png` });
        await page.context().close();
      });
    }
  }

  test("traffic in space is shown from above, and in perspective on request", async () => {
    const page = await open("departures.toml", 1280, false);
    await seek(page, 40);
    const view = page.locator(".view");
    await expect.poll(() => view.getAttribute("data-blocks"), { timeout: WAIT_MS }).not.toBe(null);
    // The legend of colors leaves the profile free.
    const legend = page.getByRole("region", { name: "Colors" });
    const bottom_px = async (): Promise<number> => {
      const box = (await legend.boundingBox())!;
      return box.y + box.height;
    };
    await page.getByLabel("Colors", { exact: true }).selectOption("speed");
    await legend.waitFor();
    const withProfile_px = await bottom_px();
    await page.getByRole("checkbox", { name: "profile" }).uncheck();
    await expect.poll(bottom_px, { timeout: WAIT_MS }).toBeGreaterThan(withProfile_px + 60);
    const toSpace = page.getByRole("button", { name: "3-D" });
    await toSpace.click();
    await drawn(page);
    // The picture that is made anew does not take the focus.
    expect(await toSpace.evaluate((button) => document.activeElement === button)).toBe(true);
    expect(await view.getAttribute("data-blocks")).toBe(null);
    await page.screenshot({ path: "screenshots/plan-3d.png" });
    await page.getByRole("button", { name: "3-D" }).click();
    await expect.poll(() => view.getAttribute("data-blocks"), { timeout: WAIT_MS }).not.toBe(null);
    await page.context().close();
  });
});
