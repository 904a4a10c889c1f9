/** Use of the page in a real browser, against a fake server. */

import { readFileSync } from "node:fs";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import { drawn, launch, openNew, openPage, WAIT_MS, type PageOptions } from "../browser";
import { readImage } from "../pixels";
import { FakeServer, PARTING } from "../fake/server";

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

async function visit(world: string | null, look: PageOptions = {}): Promise<void> {
  ({ page, consoleErrors } = await openPage(browser, server.url, look));
  if (world) await openNew(page, world);
}

const cycle = async (): Promise<number> => Number((await page.getByTestId("cycle").textContent())!.replace(/\D/g, ""));

/** Waits until the shown cycle is this one, or passes a test. */
async function cycleIs(wanted: number | ((c: number) => boolean)): Promise<void> {
  const passes = typeof wanted === "number" ? (c: number): boolean => c === wanted : wanted;
  await expect.poll(async () => passes(await cycle()), { timeout: WAIT_MS }).toBe(true);
}

const asked = (what: string): number => server.calls.filter((call) => call.do === what).length;

async function askedFor(what: string, times: number): Promise<void> {
  await expect.poll(() => asked(what), { timeout: 30_000 }).toBeGreaterThanOrEqual(times);
}

describe("transport", () => {
  test("a run is opened, played, paused and stepped without errors", async () => {
    await visit("robots");
    expect(await cycle()).toBe(0);
    await page.getByRole("button", { name: "Play", exact: true }).click();
    await cycleIs((c) => c >= 3);
    await page.getByRole("button", { name: "Pause" }).click();
    await page.getByTestId("state").filter({ hasText: "paused" }).waitFor();
    const stopped = await cycle();
    await page.getByRole("button", { name: "One cycle forward" }).click();
    await cycleIs(stopped + 1);
    await page.getByRole("button", { name: "One cycle back" }).click();
    await cycleIs(stopped);
    expect(consoleErrors).toEqual([]);
  });

  test("the timeline seeks, and shows events as ticks", async () => {
    await visit("robots");
    const slider = page.getByRole("slider", { name: "Cycle" });
    await slider.fill("5000");
    await cycleIs(5000);
    await page
      .getByRole("button", { name: /^contact/ })
      .first()
      .waitFor();
    const colored = await page.locator(".timeline canvas").evaluate((canvas: HTMLCanvasElement) => {
      const { data } = canvas.getContext("2d")!.getImageData(0, 0, canvas.width, canvas.height);
      return data.some((value, i) => i % 4 === 3 && value > 0);
    });
    expect(colored).toBe(true);
    // The list shows the place of the run, and the rows there when it is scrolled.
    await page.locator(".events .row.now").waitFor();
    await page.locator(".events .list").evaluate((list) => (list.scrollTop = 0));
    await page.locator(".events .row:not(.later)").first().waitFor();
    await slider.fill("12");
    await cycleIs(12);
    expect(consoleErrors).toEqual([]);
  });

  test("headings of groups are reached and closed by keys, without a change of the selection", async () => {
    await visit("robots");
    const tree = page.getByRole("tree", { name: "Agents" });
    const heading = tree.getByRole("treeitem", { name: /couriers/ });
    const active = (): Promise<string | null> =>
      tree.evaluate(
        (one) => document.getElementById(one.getAttribute("aria-activedescendant") ?? "")?.textContent ?? null,
      );
    await tree.focus();
    await page.keyboard.press("Home");
    await expect.poll(active).toMatch(/couriers/);
    await page.keyboard.press("ArrowDown");
    const first = tree.getByRole("treeitem", { selected: true });
    expect(await first.getAttribute("aria-posinset")).toBe("1");
    expect(await first.getAttribute("aria-setsize")).toBe("8");
    await page.keyboard.press("ArrowUp");
    await expect.poll(active).toMatch(/couriers/);
    expect(await first.count()).toBe(1);
    await page.keyboard.press("Enter");
    await expect.poll(() => heading.getAttribute("aria-expanded")).toBe("false");
    await page.keyboard.press("ArrowRight");
    await expect.poll(() => heading.getAttribute("aria-expanded")).toBe("true");
    await page.keyboard.press(" ");
    await expect.poll(() => heading.getAttribute("aria-expanded")).toBe("false");
    expect(await page.getByRole("button", { name: "Play", exact: true }).count()).toBe(1);
  });

  test("the box of more options lies within a narrow page", async () => {
    await visit("robots", { width: 400 });
    await page.getByRole("button", { name: "More", exact: true }).click();
    const box = (await page.getByRole("group", { name: "More display options" }).boundingBox())!;
    expect(box.x).toBeGreaterThanOrEqual(0);
    expect(box.x + box.width).toBeLessThanOrEqual(400);
  });

  test("a run plays backwards and can be paused", async () => {
    await visit("robots");
    await page.getByRole("slider", { name: "Cycle" }).fill("800");
    await cycleIs(800);
    await page.getByLabel("Speed", { exact: true }).selectOption("10");
    await page.locator("canvas.picture").focus();
    await page.keyboard.press("b");
    await page.getByTestId("state").filter({ hasText: "playing back" }).waitFor();
    await cycleIs((c) => c < 770);
    await page.keyboard.press(" ");
    await page.getByTestId("state").filter({ hasText: "paused" }).waitFor();
    // One step may still have been under way.
    await askedFor("pause", 1);
    await page.getByRole("slider", { name: "Cycle" }).fill("600");
    await cycleIs(600);
    const seeks = asked("seek");
    await page.getByRole("button", { name: "One cycle forward" }).click();
    await cycleIs(601);
    expect(asked("seek")).toBe(seeks);
    await page.getByRole("button", { name: "Play backwards" }).click();
    await cycleIs((c) => c < 590);
    expect(consoleErrors).toEqual([]);
    expect(await page.getByRole("alert").textContent()).toBe("");
  });

  test("another seed restarts the run", async () => {
    await visit("robots");
    await page.getByRole("slider", { name: "Cycle" }).fill("100");
    await cycleIs(100);
    await page.getByRole("textbox", { name: "Seed" }).fill("77");
    await page.getByRole("button", { name: "Restart" }).click();
    await page.getByRole("button", { name: /seed 77/ }).waitFor();
    await cycleIs(0);
  });

  test("dropped frames are displayed", async () => {
    await visit("robots");
    await page.evaluate(() => {
      const draw = window.requestAnimationFrame.bind(window);
      window.requestAnimationFrame = () => 0;
      window.addEventListener("blur", () => (window.requestAnimationFrame = draw));
    });
    await page.getByLabel("Speed", { exact: true }).selectOption("fastest");
    await page.getByRole("button", { name: "Play", exact: true }).click();
    await expect.poll(() => server.leftOut(), { timeout: 30_000 }).toBeGreaterThan(3);
    await page.evaluate(() => window.dispatchEvent(new Event("blur")));
    await page.getByRole("button", { name: "Fit" }).click();
    await page.getByTestId("left-out").filter({ hasText: "frames" }).waitFor();
  });
});

describe("agents", () => {
  test("a click in the view selects, and the inspector shows facts", async () => {
    await visit("airspace");
    await page.getByRole("slider", { name: "Cycle" }).fill("10");
    await cycleIs(10);
    const found = await page.locator(".view").evaluate((view) => {
      const box = view.getBoundingClientRect();
      return { x: box.x, y: box.y, width: box.width, height: box.height };
    });
    // ONE11 flies east through the middle of the picture's height: look for it there.
    let met = false;
    for (let x = 10; x < found.width && !met; x += 7) {
      await page.mouse.move(found.x + x, found.y + found.height / 2 + 3);
      met = await page.locator(".tip").isVisible();
      if (met) await page.mouse.click(found.x + x, found.y + found.height / 2 + 3);
    }
    expect(met).toBe(true);
    await page.getByRole("heading", { name: /^ONE1/ }).waitFor();
    await page.getByText("probability").waitFor();
    await page.getByRole("list", { name: "Marks" }).getByText("chosen").waitFor();
  });

  test("the list selects, filters ten thousand agents, and renders only visible rows", async () => {
    await visit("crowd");
    await page.getByTestId("agent-count").filter({ hasText: "10000" }).waitFor();
    expect(await page.locator(".agents .row:not(.group)").count()).toBeLessThan(60);
    await page.keyboard.press("/");
    await page.keyboard.type("robot 9999");
    await page.getByTestId("agent-count").filter({ hasText: "1 of 10000" }).waitFor();
    await page.keyboard.press("Enter");
    await page.getByRole("heading", { name: "robot 9999" }).waitFor();
    await page.getByText("nearest wall").waitFor();
    await page
      .getByRole("button", { name: "robot 0" })
      .or(page.getByRole("button", { name: "courier Anna" }))
      .first()
      .click();
    await page.getByRole("heading", { name: "courier Anna" }).waitFor();
  });

  test("beams of the selected agent are requested and shown with a legend", async () => {
    await visit("robots");
    await page.locator(".agents .row", { hasText: "robot 5" }).first().click();
    await page.getByRole("list", { name: "Marks" }).getByText("as reported").waitFor();
    expect(server.calls.some((call) => call.do === "select-scans" && call.bodies[0]?.number === 5)).toBe(true);
  });
});

describe("events", () => {
  test("a click seeks and selects, kinds can be hidden, and keys jump", async () => {
    await visit("robots");
    await page.getByRole("slider", { name: "Cycle" }).fill("400");
    await cycleIs(400);
    await page
      .getByRole("group", { name: "Kinds of events" })
      .getByRole("button", { name: /contact/ })
      .click();
    await page.getByTestId("event-count").filter({ hasText: /^3$/ }).waitFor();
    await page.getByRole("listitem").getByRole("button", { name: /trip/ }).nth(1).click();
    await cycleIs(220);
    await page.getByRole("heading", { name: "robot 4" }).waitFor();
    await page.locator("canvas.picture").focus();
    await page.keyboard.press("k");
    await cycleIs(110);
    await page.keyboard.press("j");
    await cycleIs(220);
  });
});

describe("text", () => {
  test("a wrong key is marked at its position and refused, and a valid text runs", async () => {
    await visit("robots");
    await page.getByRole("tab", { name: "Text" }).click();
    const text = page.getByRole("textbox", { name: "Text of the scenario" });
    await text.waitFor();
    await page.getByTestId("check").filter({ hasText: "no problems" }).waitFor();
    await text.click();
    await page.keyboard.press("Control+End");
    await page.keyboard.type("\ncuont = 3");
    await page.getByTestId("check").filter({ hasText: "1 problem" }).waitFor();
    await page.locator(".cm-lintRange-error").waitFor();
    await page.getByRole("list", { name: "Problems" }).getByText("no key `cuont`").waitFor();
    await page.getByRole("button", { name: "Run", exact: true }).click();
    await page.getByRole("alert").getByText("no key `cuont`").waitFor();
    await page.getByRole("alert").getByRole("button", { name: "Dismiss" }).click();
    await text.click();
    await page.keyboard.press("Control+End");
    for (let i = 0; i < "cuont = 3".length; i++) await page.keyboard.press("Backspace");
    await page.keyboard.type("size = 3");
    await page.getByTestId("check").filter({ hasText: "no problems" }).waitFor();
    await page.getByRole("button", { name: "Run", exact: true }).click();
    await page.locator("canvas.picture").waitFor();
    const restart = server.calls.findLast((call) => call.do === "restart");
    expect(restart?.do === "restart" && restart.text?.endsWith("size = 3")).toBe(true);
    expect(consoleErrors).toEqual([]);
  });
});

describe("keyboard", () => {
  test("keys play, step, change speed, show help, and leave fields alone", async () => {
    await visit("robots");
    const speed = page.getByLabel("Speed", { exact: true });
    await page.locator("canvas.picture").focus();
    await page.keyboard.press("]");
    expect(await speed.inputValue()).toBe("2");
    await page.keyboard.press("[");
    await page.keyboard.press("[");
    expect(await speed.inputValue()).toBe("0.5");
    await page.keyboard.press("ArrowRight");
    await cycleIs(1);
    await page.keyboard.press("Shift+ArrowRight");
    await cycleIs(11);
    await page.keyboard.press("ArrowLeft");
    await cycleIs(10);
    await page.keyboard.press(" ");
    await cycleIs((c) => c > 10);
    await page.keyboard.press(" ");
    await page.getByTestId("state").filter({ hasText: "paused" }).waitFor();
    await page.keyboard.press("?");
    await page.getByRole("dialog", { name: "Help" }).waitFor();
    await page.keyboard.press("Escape");
    await page.keyboard.press("t");
    expect(await page.getByLabel("Trails").inputValue()).toBe("all");
    const plays = asked("play");
    await page.getByRole("searchbox", { name: "Filter agents" }).focus();
    await page.keyboard.type("j k f");
    expect(asked("play")).toBe(plays);
  });

  test("everything can be reached by Tab, with a visible focus", async () => {
    await visit("robots");
    const reached = new Set<string>();
    for (let i = 0; i < 60; i++) {
      await page.keyboard.press("Tab");
      const [name, ring] = await page.evaluate(() => {
        const e = document.activeElement as HTMLElement;
        if (e === document.body) return ["", ""] as const;
        return [
          e.getAttribute("aria-label") ?? e.textContent?.trim().slice(0, 20) ?? "",
          getComputedStyle(e).outlineStyle,
        ] as const;
      });
      if (name) reached.add(name);
      if (name) expect([name, ring]).not.toEqual([name, "none"]);
    }
    for (const name of ["Open…", "Agents", "Filter agents", "Play", "Cycle", "Speed", "Restart", "Help", "Trails"]) {
      expect(
        [...reached].some((one) => one.startsWith(name)),
        name,
      ).toBe(true);
    }
  });
});

describe("layout", () => {
  for (const width of [400, 1280]) {
    test(`at ${width} pixels nothing needs horizontal scrolling`, async () => {
      await visit("airspace", { width });
      await page.locator(".agents .row:not(.group)").first().click();
      for (const tab of width === 400 ? ["agents", "events", "inspector", "charts"] : []) {
        await page.getByRole("tab", { name: tab }).click();
        const box = await page.getByRole("tabpanel").boundingBox();
        expect(box!.x >= 0 && box!.x + box!.width <= width).toBe(true);
      }
      const wide = await page.evaluate(() => document.scrollingElement!.scrollWidth);
      expect(wide).toBeLessThanOrEqual(width);
      for (const name of ["Play", "Restart", "Open…", "Help"]) {
        const box = (await page.getByRole("button", { name }).first().boundingBox())!;
        expect(box.x >= 0 && box.x + box.width <= width && box.y + box.height <= 800, name).toBe(true);
      }
    });
  }

  test("dark and light follow the system, and a switch", async () => {
    await visit("robots", { isDark: true });
    const back = (): Promise<string> => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    const dark = await back();
    await page.getByRole("button", { name: "Light theme" }).click();
    expect(await back()).not.toBe(dark);
    await page.emulateMedia({ colorScheme: "light" });
    await page.getByRole("button", { name: "Dark theme" }).click();
    expect(await back()).toBe(dark);
  });
});

describe("results", () => {
  /** Opens something of the list. */
  async function openFile(name: RegExp): Promise<void> {
    await visit(null);
    await page.getByRole("button", { name: /^Open a scenario/ }).click();
    await page.getByRole("dialog", { name: "Open" }).getByRole("button", { name }).click();
  }

  test("the report of a recording is shown in a sandboxed frame, and can be downloaded in parts", async () => {
    await openFile(/robots\.run/);
    await page.getByRole("tab", { name: "Report" }).click();
    const frame = page.frameLocator("iframe");
    await frame.getByRole("heading", { name: "Report of robots.run" }).waitFor();
    await frame.getByText("origin null").waitFor();
    await expect.poll(() => page.frames()[1]!.title(), { timeout: 20_000 }).toBe("kept in");
    await page.getByText("figures (1)").click();
    await page.getByRole("link", { name: "01-speed" }).waitFor();
    const kept = page.waitForEvent("download");
    await page.getByRole("link", { name: "Markdown" }).click();
    expect((await kept).suggestedFilename()).toBe("made-up.markdown");
    await page.setViewportSize({ width: 400, height: 800 });
    await page.getByRole("tablist", { name: "Panels" }).waitFor({ state: "detached" });
    await page.getByRole("tab", { name: "View" }).click();
    await page.locator("canvas.picture").waitFor();
  });

  test("a chart offers no metric that another one shows", async () => {
    await visit("robots");
    const charts = page.getByRole("combobox", { name: "Metric" });
    await charts.nth(2).waitFor();
    expect(await charts.first().getByRole("option").count()).toBe(2);
    await charts.first().selectOption({ index: 1 });
    expect(await charts.count()).toBe(3);
    expect(consoleErrors).toEqual([]);
  });

  test("the reason for a missing report is shown in its place, and other sessions show their view", async () => {
    await openFile(/broken\.run/);
    await page.getByRole("tab", { name: "Report" }).click();
    await page.getByText("it is cut off").waitFor();
    await page.getByText("record it again").waitFor();
    await openFile(/^chain\.toml/);
    await page.getByRole("tab", { name: "View", selected: true }).waitFor();
    await page.getByRole("button", { name: "Fit" }).waitFor();
    await page.getByRole("region", { name: "Charts" }).waitFor();
  });

  test("the view and the tables of a recording are exported as files", async () => {
    await openFile(/robots\.run/);
    await drawn(page);
    await page.getByRole("slider", { name: "Cycle" }).fill("50");
    await cycleIs(50);
    await page.getByRole("button", { name: "Export…" }).click();
    const dialog = page.getByRole("dialog", { name: /^Export/ });
    const picture = page.waitForEvent("download");
    await dialog.getByRole("button", { name: "Image (PNG)" }).click();
    const file = await picture;
    expect(file.suggestedFilename()).toBe("Made-up-hall-50.png");
    const bytes = readFileSync((await file.path())!);
    const { colors } = await readImage(page, bytes);
    expect(colors).toBeGreaterThan(20);
    expect(await dialog.getByRole("link", { name: "cycle 50 (SVG)" }).getAttribute("href")).toBe(
      "/export?path=robots.run&as=svg&cycle=50",
    );
    const table = page.waitForEvent("download");
    await dialog.getByRole("row", { name: "trajectories" }).getByRole("link", { name: "CSV" }).click();
    expect((await table).url()).toContain("/export?path=robots.run&as=csv&table=trajectories");
    expect(consoleErrors).toEqual([]);
  });

  test("a sweep shows its report and its runs, and a run is opened with its seed", async () => {
    await openFile(/^sweep/);
    await page.getByTestId("run-count").filter({ hasText: "7" }).waitFor();
    await page.frameLocator("iframe").getByRole("heading", { name: "Report of sweep" }).waitFor();
    await page.getByText("The sweep is not complete.").waitFor();
    await page.getByRole("searchbox", { name: "Filter runs" }).fill("= 8");
    await page.getByTestId("run-count").filter({ hasText: "1" }).waitFor();
    await page.getByRole("searchbox", { name: "Filter runs" }).fill("");
    await page
      .getByRole("listitem")
      .getByRole("button", { name: /count = 4, seed 2/ })
      .click();
    await page.getByRole("button", { name: /seed 2/ }).waitFor();
    await drawn(page);
    await page.getByRole("button", { name: /sweep · sweep/ }).click();
    await page.frameLocator("iframe").getByRole("heading", { name: "Report of sweep" }).waitFor();
    await page.getByRole("button", { name: "Close sweep" }).click();
    await page.locator("canvas.picture").waitFor();
  });

  test("a variant clicked in a report opens its first run, by name or number", async () => {
    await openFile(/^sweep/);
    await page.getByTestId("run-count").filter({ hasText: "7" }).waitFor();
    const report = page.frameLocator("iframe");
    await report.getByRole("button", { name: "0001" }).click();
    await drawn(page);
    const opened = (): unknown => server.calls.filter((call) => call.do === "open").at(-1);
    expect(opened()).toEqual({ do: "open", target: { kind: "scenario", path: "robots.toml" }, seed: 1 });
    await page.getByRole("button", { name: /sweep · sweep/ }).click();
    await report.getByRole("button", { name: "count = 4" }).click();
    await drawn(page);
    // The frame itself tries forbidden actions.
    expect(consoleErrors.filter((words) => !words.includes("/enter") && !words.includes("Fetch API"))).toEqual([]);
  });
});

describe("sessions", () => {
  test("two sessions side by side run in step only if requested", async () => {
    await visit("robots");
    await page.getByRole("button", { name: "Open…" }).click();
    await page.getByRole("dialog", { name: "Open" }).getByRole("button", { name: "chain", exact: true }).click();
    await page.getByRole("button", { name: "Side by side" }).click();
    await page.waitForFunction(() => document.querySelectorAll("canvas.picture").length === 2);
    await page.locator("canvas.picture").first().focus();
    await page.keyboard.press("ArrowRight");
    await cycleIs(1);
    expect(asked("step")).toBe(1);
    await page.getByRole("button", { name: "In step" }).click();
    await page.locator("canvas.picture").first().focus();
    await page.keyboard.press("ArrowRight");
    await cycleIs(2);
    await askedFor("step", 3);
    await page.getByRole("button", { name: "Close Made-up snake" }).click();
    await page.waitForFunction(() => document.querySelectorAll("canvas.picture").length === 1);
  });

  test("the first difference of two runs in step is found, with the bodies that differ", async () => {
    await visit("robots");
    await page.getByRole("button", { name: "Open…" }).click();
    const dialog = page.getByRole("dialog", { name: "Open" });
    await dialog.getByRole("textbox", { name: "Seed" }).fill("2");
    await dialog.getByRole("button", { name: "robots", exact: true }).click();
    await page.getByRole("button", { name: "In step" }).click();
    await page.getByRole("button", { name: "First difference" }).click();
    await page
      .getByTestId("difference")
      .filter({ hasText: `from cycle ${PARTING} on: robot 3 is 0.25\u202fm apart.` })
      .waitFor();
    await cycleIs(PARTING);
    await page.getByRole("heading", { name: "robot 3" }).waitFor();
    expect(consoleErrors).toEqual([]);
  });

  for (const [status, words] of [
    [503, "Too many pages"],
    [401, "Open the whole address"],
    [421, "does not accept this address"],
  ] as const) {
    test(`a server that replies ${status} is reported as such, and reconnected`, async () => {
      await visit("robots");
      await page.getByRole("button", { name: "Play", exact: true }).click();
      await cycleIs((c) => c > 2);
      server.entrance = status;
      await server.stop();
      await server.start();
      await page.getByTestId("banner").filter({ hasText: words }).waitFor();
      server.entrance = 204;
      await page.getByTestId("banner").filter({ hasText: "reopened Made-up hall" }).waitFor();
      await page.getByTestId("state").filter({ hasText: "playing" }).waitFor();
    });
  }

  test("a target that cannot be opened is reported with a remedy", async () => {
    await visit(null);
    await page.getByRole("button", { name: /^Open a scenario/ }).click();
    await page.getByRole("button", { name: /nowhere/ }).click();
    await page.getByRole("alert").getByText("there is no such scenario").waitFor();
    await page.getByRole("alert").getByText("choose another one").waitFor();
  });

  test("a session that has ended shows the reason", async () => {
    await visit("robots");
    server.endAll();
    await page.getByTestId("ended").getByText("the disk is full").waitFor();
    await page.getByTestId("ended").getByText("make room").waitFor();
  });

  test("a recording that was playing is reopened in its state", async () => {
    await visit(null);
    await page.getByRole("button", { name: /^Open a scenario/ }).click();
    await page.getByRole("button", { name: /chain\.mcap/ }).click();
    await page.getByRole("slider", { name: "Cycle" }).fill("100");
    await cycleIs(100);
    await server.stop();
    await page.getByTestId("banner").filter({ hasText: "does not answer" }).waitFor();
    await server.start();
    await page.getByTestId("banner").filter({ hasText: "reopened Made-up snake at cycle 100" }).waitFor();
    await cycleIs(100);
  });

  test("sessions are restored after the server restarts", async () => {
    await visit("robots");
    await page.getByRole("slider", { name: "Cycle" }).fill("345");
    await cycleIs(345);
    await server.stop();
    await page.getByTestId("banner").filter({ hasText: "does not answer" }).waitFor();
    await server.start();
    await page.getByTestId("banner").filter({ hasText: "reopened Made-up hall at cycle 345" }).waitFor();
    await cycleIs(345);
    await page.getByRole("button", { name: "One cycle forward" }).click();
    await cycleIs(346);
  });
});
