/** axe finds no accessibility problems in any state of the page. */

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { launch, openNew, openPage } from "../browser";
import { FakeServer } from "../fake/server";

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const server = new FakeServer("dist");
let browser: Browser;
beforeAll(async () => {
  await server.start();
  browser = await launch();
});
afterAll(async () => {
  await browser.close();
  await server.stop();
});

interface Finding {
  id: string;
  nodes: { target: string[]; failureSummary: string }[];
}

async function findings(page: Page): Promise<string[]> {
  await page.evaluate(AXE);
  const found = await page.evaluate(async () => {
    const { axe } = window as unknown as { axe: { run(): Promise<{ violations: Finding[] }> } };
    return (await axe.run()).violations;
  });
  return found.map(
    ({ id, nodes }) => `${id}: ${nodes.map((n) => `${n.target.join(" ")} ${n.failureSummary}`).join("; ")}`,
  );
}

for (const [width, isDark] of [
  [1280, false],
  [1280, true],
  [400, false],
  [400, true],
] as const) {
  test(`at ${width} pixels, ${isDark ? "dark" : "light"}`, async () => {
    const { page } = await openPage(browser, server.url, { width, isDark });
    await page.getByRole("button", { name: /^Office building/ }).waitFor();
    expect(await findings(page)).toEqual([]);
    await page.getByRole("button", { name: /^Open a scenario/ }).click();
    await page.getByRole("button", { name: /^more/ }).waitFor();
    expect(await findings(page)).toEqual([]);
    await page.getByRole("button", { name: "All files" }).click();
    await page.getByText("plan of a sweep").waitFor();
    expect(await findings(page)).toEqual([]);
    await page.keyboard.press("Escape");
    await openNew(page, "robots");
    await page.getByRole("slider", { name: "Cycle" }).fill("300");
    await page.locator(".agents .row:not(.group)").nth(2).click();
    if (width === 400) await page.getByRole("tab", { name: "inspector" }).click();
    await page.locator("details").first().waitFor();
    expect(await findings(page)).toEqual([]);
    if (width === 400) await page.getByRole("tab", { name: "events" }).click();
    await page
      .getByRole("button", { name: /^contact/ })
      .first()
      .waitFor();
    expect(await findings(page)).toEqual([]);
    await page.getByRole("tab", { name: "Text" }).click();
    await page.getByTestId("check").filter({ hasText: "no problems" }).waitFor();
    expect(await findings(page)).toEqual([]);
    await page.getByRole("tab", { name: "Forms" }).click();
    await page.getByRole("button", { name: "robots 1: couriers" }).click();
    await page.getByLabel("size", { exact: true }).fill("2.5");
    await page.keyboard.press("Tab");
    await page.getByText("write a whole number").waitFor();
    expect(await findings(page)).toEqual([]);
    await page.getByRole("button", { name: "sensors: echo" }).click();
    await page.getByRole("textbox", { name: "wall, wall" }).fill("0.6");
    await page.keyboard.press("Tab");
    await page.getByTestId("check").filter({ hasText: "1 problem" }).waitFor();
    expect(await findings(page)).toEqual([]);
    await page.getByRole("button", { name: "Scale the row wall to 1" }).click();
    await page.getByTestId("check").filter({ hasText: "no problems" }).waitFor();
    await page.getByRole("tab", { name: "View" }).click();
    await page.getByRole("button", { name: "Edit", exact: true }).click();
    await page.locator("canvas.layer").focus();
    await page.keyboard.press("n");
    await page.getByRole("button", { name: "Rotate" }).waitFor();
    expect(await findings(page)).toEqual([]);
    await page.keyboard.press("2");
    await page.getByLabel("Draws").waitFor();
    expect(await findings(page)).toEqual([]);
    await page.keyboard.press("Control+s");
    await page.getByRole("dialog", { name: "Save as" }).waitFor();
    expect(await findings(page)).toEqual([]);
    server.theirs = "# theirs\nformat = 1\n";
    await page.getByRole("dialog", { name: "Save as" }).getByRole("button", { name: "Save", exact: true }).click();
    await page.getByRole("dialog", { name: /was changed/ }).waitFor();
    expect(await findings(page)).toEqual([]);
    server.theirs = null;
    await page.keyboard.press("Escape");
    await page.getByRole("button", { name: "New…" }).click();
    await page.getByRole("dialog", { name: /^Draw a new/ }).waitFor();
    expect(await findings(page)).toEqual([]);
    await page.keyboard.press("Escape");
    await page.getByRole("button", { name: "Edit", exact: true }).click();
    await page.getByRole("button", { name: "Export…" }).click();
    await page.getByRole("dialog", { name: /^Export/ }).waitFor();
    expect(await findings(page)).toEqual([]);
    await page.keyboard.press("Escape");
    await page.getByRole("button", { name: "Help" }).click();
    await page.getByRole("heading", { name: "Memory of the server" }).waitFor();
    expect(await findings(page)).toEqual([]);
    await page.context().close();
  });
}
