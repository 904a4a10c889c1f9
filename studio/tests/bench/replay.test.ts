/**
 * Replays in one file: their sizes, seconds until the first picture, and pictures per second while somebody scrubs, in
 * headless Chromium from `file://`. REPLAYS names the files, separated by commas; skipped without.
 */

import { statSync } from "node:fs";
import { basename } from "node:path";
import { pathToFileURL } from "node:url";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { drawn, launch, openPage } from "../browser";

const FILES = (process.env.REPLAYS ?? "").split(",").filter((file) => file !== "");
const BAR_S = 2;
const BAR_PICTURES_PER_S = 30;
const SCRUB_MS = 4000;

describe.skipIf(FILES.length === 0)("replays", () => {
  let browser: Browser;
  beforeAll(async () => {
    browser = await launch();
  });
  afterAll(async () => browser?.close());

  for (const file of FILES) {
    test(`${basename(file)} opens and is scrubbed`, async () => {
      const { page, consoleErrors } = await openPage(browser, "about:blank");
      await page.context().setOffline(true);
      const began = performance.now();
      await page.goto(pathToFileURL(file).href);
      await drawn(page);
      const open_s = (performance.now() - began) / 1000;
      // The pointer goes forth and back over the whole timeline, with a new cycle in each picture of the browser.
      const [pictures, possible] = await page.evaluate(async (duration_ms) => {
        const slider = document.querySelector<HTMLInputElement>(".timeline input")!;
        const view = document.querySelector<HTMLElement>(".view")!;
        const before = Number(view.dataset.pictures);
        const started = performance.now();
        let possible = 0;
        for (let spent = 0; spent < duration_ms; spent = performance.now() - started) {
          const fraction = Math.abs(((spent / 1500) % 2) - 1);
          slider.value = String(Math.round(fraction * Number(slider.max)));
          slider.dispatchEvent(new Event("input", { bubbles: true }));
          possible++;
          await new Promise((then) => requestAnimationFrame(then));
        }
        return [Number(view.dataset.pictures) - before, possible] as const;
      }, SCRUB_MS);
      const rate = (1000 * pictures) / SCRUB_MS;
      // Times are measured here, not required: they are those of the machine, too.
      console.log(
        `${basename(file)}: ${(statSync(file).size / 1e6).toFixed(2)} MB, first picture after ${open_s.toFixed(2)} s (bar ${BAR_S} s), ` +
          `${rate.toFixed(0)} pictures/s while scrubbing (bar ${BAR_PICTURES_PER_S}), ${pictures} of the ${possible} that the browser made`,
      );
      expect(consoleErrors).toEqual([]);
      await page.context().close();
    });
  }
});
