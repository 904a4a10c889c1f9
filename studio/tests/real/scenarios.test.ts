/** All shipped kinds of scenarios through the real program. */

import { mkdirSync } from "node:fs";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { drawn, launch, openPage } from "../browser";
import { BINARY, Program, SCENARIOS as FOLDER } from "./program";

/** Screenshots for people; MANY=1 for all widths and themes. */
const LOOKS = process.env.MANY
  ? ([
      [1280, false],
      [1280, true],
      [400, false],
      [400, true],
    ] as const)
  : ([[1280, false]] as const);

const SCENARIOS = [
  ["robots", "office.toml"],
  ["robots", "crossing.toml"],
  ["robots", "radio.toml"],
  ["chain", "arm.toml"],
  ["chain", "snake3d.toml"],
  ["chain", "movers.toml"],
  ["chain", "serpentine.toml"],
  ["airspace", "superconflict.toml"],
] as const;

describe.skipIf(BINARY === "")("the real program", () => {
  let browser: Browser;
  let program: Program;
  beforeAll(async () => {
    program = await Program.start(FOLDER);
    mkdirSync("screenshots", { recursive: true });
    browser = await launch();
  });
  afterAll(async () => {
    await browser?.close();
    await program?.stop();
  });

  for (const [folder, name] of SCENARIOS) {
    for (const [width, isDark] of LOOKS) {
      test(`${folder}/${name} at ${width}${isDark ? ", dark" : ""} plays and is inspected`, async () => {
        const { page, consoleErrors } = await openPage(browser, program.url, { width, isDark });
        await page.getByRole("button", { name: "Open…" }).click();
        await page.getByRole("button", { name: `${folder}/` }).click();
        await page.getByRole("button", { name }).first().click();
        await drawn(page);
        await page.getByRole("button", { name: "Play", exact: true }).click();
        await page.waitForFunction(
          () => Number(document.querySelector("[data-testid=cycle]")?.textContent?.replace(/\D/g, "")) >= 20,
        );
        await page.getByRole("button", { name: "Pause" }).click();
        await page.locator(".agents .row:not(.group)").nth(2).click();
        if (width === 400) await page.getByRole("tab", { name: "inspector" }).click();
        await page.locator(".inspector details, .inspector .problem").first().waitFor();
        // No table of the inspector is cut off at the side.
        const cut = await page
          .getByRole("region", { name: /^Table: / })
          .evaluateAll((tables) => tables.filter((table) => table.scrollWidth > table.clientWidth).length);
        expect(cut).toBe(0);
        if (width === 1280) await page.locator(".chart .value").filter({ hasText: /\d/ }).first().waitFor();
        await page.screenshot({
          path: `screenshots/real-${folder}-${name.replace(".toml", "")}-${width}${isDark ? "-dark" : ""}.png`,
        });
        expect(consoleErrors).toEqual([]);
        await page.context().close();
      });
    }
  }
});
