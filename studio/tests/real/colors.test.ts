/** Colors of agents by their metrics, their groups, events found by words, and joints, from the real program. */

import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, describe, expect, test } from "vitest";
import { drawn, launch, openPage } from "../browser";
import type { BodyId, RunEvent } from "../../src/protocol";
import { BINARY, Program, SCENARIOS } from "./program";
import { connectStudio } from "./studio";

describe.skipIf(BINARY === "")("the real program", () => {
  let browser: Browser;
  let program: Program;
  let page: Page;
  let consoleErrors: string[];
  beforeAll(async () => {
    program = await Program.start(SCENARIOS);
    browser = await launch();
  });
  afterAll(async () => {
    await browser?.close();
    await program?.stop();
  });
  afterEach(async () => {
    if (!page) return;
    expect(consoleErrors).toEqual([]);
    await page.context().close();
  });

  async function open(folder: string, name: string, cycle: number): Promise<void> {
    ({ page, consoleErrors } = await openPage(browser, program.url));
    await page.getByRole("button", { name: "Open…" }).click();
    await page.getByRole("button", { name: `${folder}/` }).click();
    await page.getByRole("button", { name }).first().click();
    await drawn(page);
    await page.getByRole("slider", { name: "Cycle" }).fill(String(cycle));
    await page.getByTestId("state").filter({ hasText: "paused" }).waitFor();
  }

  const legend = () => page.getByRole("region", { name: "Colors" });

  for (const [folder, name, metric] of [
    ["robots", "office.toml", "counts.contacts"],
    ["chain", "movers.toml", "progress"],
    ["airspace", "superconflict.toml", "alone_s"],
  ] as const) {
    test(`${name} is colored by the metric ${metric}`, async () => {
      await open(folder, name, 60);
      const colors = page.getByLabel("Colors", { exact: true });
      await colors.locator(`option[value="metric:${metric}"]`).waitFor({ state: "attached" });
      await colors.selectOption(`metric:${metric}`);
      await legend().getByText("at cycle 60").waitFor();
      const ends = await legend().locator(".ends span").allTextContents();
      expect(ends.length).toBe(3);
      expect(ends[0]).not.toBe(ends[2]);
    });
  }

  test("events are found by the words of a robot", async () => {
    await open("robots", "office.toml", 1500);
    await page.getByLabel("Search events").fill("robot 1 wall");
    const rows = page.locator(".events .row");
    await page
      .getByTestId("event-count")
      .filter({ hasText: /found|first/ })
      .waitFor();
    expect(await rows.count()).toBeGreaterThan(0);
    for (const text of await rows.allTextContents())
      for (const word of ["robot", "1", "wall"]) expect(text.toLowerCase()).toContain(word);
  });

  test("a search finds the events that have its words, and no others", async () => {
    const { studio, stop } = await connectStudio(program);
    await studio.open({ kind: "scenario", path: `${SCENARIOS}/robots/office.toml` });
    const session = studio.active!;
    await session.playback.seekTo(1500);
    const events = await session.client.request({ do: "events", from: 0, until: 1501, skip: 0, limit: 5000 });
    const all = events.is === "events" ? events.entries : [];
    const nameOf = (body: BodyId | null): string => (body === null ? "" : session.frames.bodies!.nameOf(body));
    const hasWords = (event: RunEvent): boolean => {
      const text = `${event.kind} ${event.text} ${nameOf(event.body)} ${nameOf(event.other)}`.toLowerCase();
      return ["robot", "1", "wall"].every((word) => text.includes(word));
    };
    const wanted = all.filter(hasWords);
    expect(wanted.length).toBeGreaterThan(0);
    expect(wanted.length).toBeLessThan(all.length);
    const answer = await session.findEvents("robot 1 wall", null, 0, 5000);
    expect(answer.is === "found-events" && answer.entries).toEqual(wanted);
    studio.close(session);
    stop();
  });

  test("the joints of an arm have degrees and limits", async () => {
    await open("chain", "arm.toml", 40);
    await page.locator(".agents .row:not(.group)").nth(1).click();
    const table = page.getByRole("region", { name: "Table: Joints" });
    await table.getByText("highest").first().waitFor();
    expect(await table.textContent()).toMatch(/170\s?°/);
    expect(await table.textContent()).toMatch(/−170\s?°/);
  });
});
