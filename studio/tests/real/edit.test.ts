/** The program at SIDESTEP_BINARY runs and writes every drawn, filled-in and typed change. */

import { copyFileSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import { drawn, launch, openPage, WAIT_MS } from "../browser";
import { PointerDriver } from "../drawing";
import { BINARY, Program, SCENARIOS } from "./program";

const HALL = `# A hall with one robot that goes east.

format = 1
world = "robots"
name = "Hall"
seed = 1
regime = "reliable"              # nothing errs

[map]
box_size_m = 0.5
ascii = """
############
#..........#
#..........#
#..........#
############
"""

[[robots]]
at = [[1, 2, 0]]                 # looks east
sensors = ["echo"]
behaviour = { kind = "replay", actions = ["forward"], repeat = true }

[sensors.echo]
bearings_deg = [0]
range_m = 2.0                    # short
observations = ["nothing", "wall", "robot"]
[sensors.echo.confusion]
# What is there is reported nearly always.
nothing = [0.98, 0.01, 0.01]
wall = [0.05, 0.90, 0.05]
robot = [0.05, 0.05, 0.90]
`;

if (BINARY === "") console.log("skipped: SIDESTEP_BINARY is not set");

describe.skipIf(BINARY === "")("the real program", () => {
  let browser: Browser;
  let program: Program;
  let folder: string;
  let page: Page;
  let hand: PointerDriver;
  let consoleErrors: string[];
  const file = (): string => join(folder, "hall.toml");

  beforeAll(async () => {
    browser = await launch();
  });
  afterAll(async () => browser?.close());
  beforeEach(async () => {
    folder = mkdtempSync(join(tmpdir(), "sidestep-studio-"));
    writeFileSync(file(), HALL);
    program = await Program.start(folder);
  });
  afterEach(async () => {
    await page?.context().close();
    await program?.stop();
    rmSync(folder, { recursive: true });
  });

  async function open(name = "hall.toml"): Promise<void> {
    ({ page, consoleErrors } = await openPage(browser, program.url));
    hand = new PointerDriver(page);
    await page.getByRole("button", { name: "Open…", exact: true }).click();
    await page.getByRole("button", { name: new RegExp(`^${name}`) }).click();
    await drawn(page);
  }

  async function edit(): Promise<void> {
    await page.getByRole("button", { name: "Edit", exact: true }).click();
    await page.locator("canvas.layer").waitFor();
    await checked();
  }

  /** Waits for a check without errors: a robot that replays its actions asks no sensor, which is told as a warning. */
  async function checked(words: string | RegExp = /(^|\s)(no|0)\s+problems/): Promise<void> {
    await page.getByTestId("check").filter({ hasText: words }).waitFor();
  }

  /** Waits for a change of the text, which is then checked. */
  async function saved(): Promise<string> {
    await page.getByRole("toolbar", { name: "Editing" }).getByText("changed, not saved").waitFor();
    await page.keyboard.press("Control+s");
    await page.getByRole("toolbar", { name: "Editing" }).getByText("changed, not saved").waitFor({ state: "hidden" });
    return readFileSync(file(), "utf8");
  }

  /** The cycle in which the robot first runs into something; none so far: infinity. */
  async function contact(): Promise<number> {
    // The list follows the run, and has only those rows that are seen; under the pointer it stays.
    const list = page.locator(".events .list");
    await list.hover();
    await list.evaluate((list) => (list.scrollTop = 0));
    const rows = page
      .getByRole("listitem")
      .filter({ hasText: /touches a wall/ })
      .locator(".cycle");
    const cycles = (await rows.allTextContents()).map((words) => Number(words.replace(/\D/g, "")));
    return Math.min(...cycles);
  }

  test("robots collide with a drawn wall at its position", async () => {
    await open();
    await page.getByRole("slider", { name: "Cycle" }).fill("100");
    // From column 1 to the wall at column 11 it is nine steps.
    await expect.poll(contact, { timeout: WAIT_MS }).toBe(9);
    await edit();
    await hand.tool("Line");
    // Box (5, 2) is 2.5 to 3 m east and 1 to 1.5 m north.
    await hand.drag([2.75, 0.75], [2.75, 1.75]);
    const text = await saved();
    expect(text).toContain('ascii = """\n############\n#....#.....#\n#....#.....#\n#....#.....#\n############\n"""');
    await page.getByRole("button", { name: "Run", exact: true }).click();
    // And three to that at column 5.
    await expect.poll(contact, { timeout: WAIT_MS }).toBe(3);
    expect(consoleErrors).toEqual([]);
  });

  test("a new robot is in the box of the click, and a moved one where it was released", async () => {
    await open();
    await edit();
    await hand.tool("Robot");
    await hand.click(4.25, 0.75);
    await page.locator(".agents .row:not(.group)").nth(1).waitFor();
    await hand.tool("Select");
    await hand.drag([0.75, 1.25], [1.75, 1.75]);
    await checked();
    expect(await saved()).toContain("at = [[3, 3, 0], [8, 1]]                 # looks east");
    await page.getByRole("button", { name: "Edit", exact: true }).click();
    await page.locator(".agents .row:not(.group)").nth(1).click();
    await page.getByText(/4\.25/).first().waitFor();
  });

  test("a wrong row is marked at its field and in the text, and scaled", async () => {
    await open();
    await page.getByRole("tab", { name: "Forms" }).click();
    await page.getByRole("button", { name: "sensors: echo" }).click();
    const cell = page.getByRole("textbox", { name: "wall, wall" });
    await cell.fill("0.4");
    await cell.press("Enter");
    await checked("1 problem");
    expect(await cell.getAttribute("aria-invalid")).toBe("true");
    expect(await page.getByRole("textbox", { name: "robot, wall" }).getAttribute("aria-invalid")).toBe("false");
    await page.getByRole("tab", { name: "Text" }).click();
    await page.locator(".cm-lintRange-error").first().waitFor();
    expect(
      await page
        .locator(".cm-line", { has: page.locator(".cm-lintRange-error") })
        .first()
        .textContent(),
    ).toContain("wall = [0.05, 0.4, 0.05]");
    await page.getByRole("tab", { name: "Forms" }).click();
    await page.getByRole("button", { name: "Scale the row wall to 1" }).click();
    await checked();
    expect(await saved()).toContain("wall = [0.1, 0.8, 0.1]");
  });

  test("comments and layout survive ten changes, and ten undo steps restore the text", async () => {
    await open();
    await page.getByRole("tab", { name: "Forms" }).click();
    await page.getByRole("button", { name: "robots 1", exact: true }).click();
    const undo = page.getByRole("button", { name: "Undo" });
    for (let size = 1; size <= 2; size++) {
      await page.getByRole("button", { name: "robots 1", exact: true }).click();
      const period = page.getByLabel("period", { exact: true });
      if (!(await period.isVisible())) await page.getByText(/more keys/).click();
      await period.fill(String(size + 1));
      await page.keyboard.press("Enter");
      await checked();
    }
    await page.getByRole("button", { name: "sensors: echo" }).click();
    for (const [row, column, value] of [
      ["nothing", "nothing", "0.96"],
      ["nothing", "wall", "0.02"],
      ["nothing", "robot", "0.02"],
    ] as const) {
      await page.getByRole("textbox", { name: `${row}, ${column}` }).fill(value);
      await page.keyboard.press("Enter");
    }
    await checked();
    await page.getByRole("tab", { name: "View" }).click();
    await edit();
    await hand.tool("Brush");
    for (const x of [2.25, 3.25, 4.25]) await hand.click(x, 0.75);
    await hand.tool("Robot");
    for (const x of [2.25, 3.25]) await hand.click(x, 1.75);
    await checked();
    const text = await saved();
    for (const comment of [
      "# A hall with one robot that goes east.",
      "# nothing errs",
      "# looks east",
      "# short",
      "# What is there is reported nearly always.",
    ]) {
      expect(text).toContain(comment);
    }
    expect(text).toContain("nothing = [0.96, 0.02, 0.02]");
    expect(text).toContain("#...#.#.#..#");
    for (let i = 0; i < 10; i++) {
      expect(await undo.isEnabled()).toBe(true);
      await undo.click();
    }
    expect(await undo.isDisabled()).toBe(true);
    await checked();
    expect(await saved()).toBe(HALL);
  });

  test("a file changed by another program is not overwritten without asking", async () => {
    await open();
    await edit();
    await hand.tool("Brush");
    await hand.click(2.25, 0.75);
    await checked();
    writeFileSync(file(), HALL.replace("seed = 1", "seed = 7"));
    await page.keyboard.press("Control+s");
    const dialog = page.getByRole("dialog", { name: /was changed/ });
    await dialog.locator(".theirs", { hasText: "seed = 7" }).waitFor();
    expect(readFileSync(file(), "utf8")).toContain("seed = 7");
    await dialog.getByRole("button", { name: "Keep mine" }).click();
    await dialog.waitFor({ state: "detached" });
    expect(readFileSync(file(), "utf8")).toContain("#...#......#");
  });

  test("a corridor with a door and five robots is drawn and run within two minutes", async () => {
    const begun = performance.now();
    ({ page, consoleErrors } = await openPage(browser, program.url));
    hand = new PointerDriver(page);
    await page.getByRole("button", { name: "New…" }).click();
    await page
      .getByRole("dialog", { name: /^Draw a new/ })
      .getByRole("button", { name: "Draw" })
      .click();
    await page.locator("canvas.layer").waitFor();
    await checked();
    await page.waitForFunction(() => document.querySelector(".agents")?.textContent?.includes("robot"));
    await hand.tool("Line");
    await hand.drag([0.375, 1.875], [9.625, 1.875]);
    await hand.drag([0.375, 4.125], [9.625, 4.125]);
    await hand.tool("Door");
    await hand.drag([4.875, 4.125], [5.375, 4.125]);
    await hand.tool("Robot");
    for (const x of [1.1, 2.6, 7.1, 8.6]) await hand.click(x, 3.1);
    await checked();
    await page.getByRole("button", { name: "Run", exact: true }).click();
    await page.waitForFunction(
      () => Number(document.querySelector("[data-testid=cycle]")?.textContent?.replace(/\D/g, "")) >= 5,
    );
    expect(await page.getByTestId("agent-count").textContent()).toContain("5");
    expect((performance.now() - begun) / 1000).toBeLessThan(120);
    expect(consoleErrors).toEqual([]);
    await page.keyboard.press("e");
    await page.locator("canvas.layer").waitFor();
    await page.keyboard.press("Control+s");
    const dialog = page.getByRole("dialog", { name: "Save as" });
    await dialog.getByLabel("Name").fill("corridor");
    await dialog.getByRole("button", { name: "Save", exact: true }).click();
    await dialog.waitFor({ state: "detached" });
    expect(readFileSync(join(folder, "corridor.toml"), "utf8")).toContain("[[doors]]");
  });

  test("the walls of a generated office can be copied into the text and edited", async () => {
    ({ page, consoleErrors } = await openPage(browser, program.url));
    hand = new PointerDriver(page);
    await page.getByRole("button", { name: "robots", exact: true }).first().click();
    await drawn(page);
    const free = await page.getByTestId("agent-count").textContent();
    await page.getByRole("button", { name: "Edit", exact: true }).click();
    await page.getByRole("button", { name: "Copy the walls into the text" }).click();
    await page.getByRole("button", { name: "Brush", exact: true }).waitFor();
    await checked();
    expect(await page.getByTestId("agent-count").textContent()).toBe(free);
    await page.getByRole("tab", { name: "Text" }).click();
    await page
      .locator(".cm-line", { hasText: /^#{40,}$/ })
      .first()
      .waitFor();
  });

  test("a polygon and a patrol are drawn with the mouse, and accepted by the program", async () => {
    copyFileSync(join(SCENARIOS, "chain", "default.toml"), join(folder, "chain.toml"));
    await open("chain.toml");
    await edit();
    await hand.tool("Polygon");
    await hand.drag([2, 5], [4, 5]);
    await checked();
    await hand.tool("Ball");
    await hand.drag([7, 5], [7.3, 5]);
    await checked();
    await hand.tool("Patrol");
    await hand.click(9, 5.5);
    await checked();
    await hand.click(9, 6.5);
    await checked();
    await page.keyboard.press("Control+s");
    await page.getByRole("toolbar", { name: "Editing" }).getByText("changed, not saved").waitFor({ state: "hidden" });
    const text = readFileSync(join(folder, "chain.toml"), "utf8");
    expect(text).toMatch(/^corners_m = \[\[2(\.0\d*)?, 5/m);
    expect(text).toMatch(/^patrol_m = \[\[7[^\]]*\], \[(9|8\.99|9\.0)[^\]]*\], \[(9|8\.99|9\.0)[^\]]*\]\]/m);
    expect(consoleErrors).toEqual([]);
  });

  test("what becomes of a map is told before it is imported, and the side of a pixel is asked for", async () => {
    // The symbols E and S are those of the League of Robot Runners.
    writeFileSync(join(folder, "depot.map"), "type octile\nheight 3\nwidth 4\nmap\n.S..\n.@@.\n....\n");
    writeFileSync(join(folder, "plan.pgm"), "P2 4 3 255 254 254 254 254 254 0 0 254 254 254 254 254\n");
    await open();
    await edit();
    const dialog = page.getByRole("dialog");
    await page.getByRole("button", { name: "Import…" }).click();
    await dialog.getByRole("button", { name: /^depot\.map/ }).click();
    const report = dialog.getByRole("region", { name: "Import report" });
    await report.getByText("map in characters (MovingAI)").waitFor();
    await report.getByText(/not used: the symbol `S`.*line 5/).waitFor();
    await report.getByRole("button", { name: "Choose another file" }).click();
    await dialog.getByRole("button", { name: /^plan\.pgm/ }).click();
    await dialog.getByRole("spinbutton").fill("0.5");
    await dialog.getByRole("button", { name: "Import", exact: true }).click();
    const text = await saved();
    expect(text).toContain('file = "plan.pgm"');
    expect(text).toContain("resolution_m = 0.5");
    expect(consoleErrors).toEqual([]);
  });

  /** Runs to the end and returns the displayed digest. */
  async function digest(): Promise<string> {
    await page.getByLabel("Speed", { exact: true }).selectOption("fastest");
    await page.getByRole("button", { name: "Play", exact: true }).click();
    return (await page.locator(".banner .digest").textContent())!;
  }

  test.each(["building.toml", "office.toml"])(
    "the walls of %s, taken into the text, give the run that they gave before",
    async (name) => {
      const examples = join(SCENARIOS, "..", "examples");
      for (const one of ["building.yaml", "building.png"]) copyFileSync(join(examples, one), join(folder, one));
      const from = name === "building.toml" ? join(examples, name) : join(SCENARIOS, "robots", name);
      writeFileSync(join(folder, name), readFileSync(from, "utf8").replace(/^cycles = .*$/m, "cycles = 300"));
      await open(name);
      const before = await digest();
      expect(before).toMatch(/^[0-9a-f]{32}$/);
      await page.getByRole("button", { name: "Edit", exact: true }).click();
      await page.getByRole("button", { name: "Copy the walls into the text" }).click();
      await page.getByRole("button", { name: "Brush", exact: true }).waitFor();
      await checked();
      await page.getByRole("button", { name: "Run", exact: true }).click();
      // It goes as fast as before, to its end.
      await page.locator("canvas.layer").waitFor({ state: "detached" });
      expect(await page.locator(".banner .digest").textContent()).toBe(before);
      expect(consoleErrors).toEqual([]);
    },
  );
});
