/** Editing a scenario on the canvas, in forms and as text, against a fake server. */

import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import type { Edit } from "../../src/protocol";
import { launch, openNew, openPage, WAIT_MS, type PageOptions } from "../browser";
import { PointerDriver } from "../drawing";
import { FakeServer } from "../fake/server";

const server = new FakeServer("dist");
let browser: Browser;
let page: Page;
let hand: PointerDriver;
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
  server.theirs = null;
});
afterEach(async () => {
  await page.context().close();
});

async function visit(world: string, look: PageOptions = {}): Promise<void> {
  ({ page, consoleErrors } = await openPage(browser, server.url, look));
  await openNew(page, world);
  hand = new PointerDriver(page);
}

async function draws(world: string, look: PageOptions = {}): Promise<void> {
  await visit(world, look);
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await page.locator("canvas.layer").waitFor();
  await checked();
}

async function checked(words = "no problems"): Promise<void> {
  await page.getByTestId("check").filter({ hasText: words }).waitFor();
}

const edits = (): Edit[] => server.calls.flatMap((call) => (call.do === "edit" ? call.edits : []));

/** Waits for a number of edits and returns the last. */
async function edited(count: number): Promise<Edit> {
  await expect.poll(() => edits().length, { timeout: 30_000 }).toBe(count);
  await checked();
  return edits().at(-1)!;
}

const text = (): string => {
  const call = server.calls.findLast((one) => one.do === "check");
  return call?.do === "check" ? call.text : "";
};

describe("the canvas", () => {
  test("a brush, a line, a rectangle and a fill draw the boxes that they cross, and the run restarts", async () => {
    await draws("robots");
    await hand.tool("Brush");
    await hand.drag([1.25, 0.75], [3.25, 0.75]);
    expect(await edited(1)).toEqual({
      op: "paint",
      key: "map.ascii",
      cells: [2, 3, 4, 5, 6].map((column) => [4, column, "#"]),
    });
    await expect.poll(() => server.calls.filter((call) => call.do === "restart").length, { timeout: 30_000 }).toBe(1);
    await hand.tool("Line");
    await hand.drag([3.75, 2.25], [4.25, 1.25]);
    expect(await edited(2)).toMatchObject({
      op: "paint",
      cells: [
        [1, 7, "#"],
        [2, 8, "#"],
        [3, 8, "#"],
      ],
    });
    await hand.tool("Eraser");
    await hand.click(2.75, 1.25);
    expect(await edited(3)).toEqual({ op: "paint", key: "map.ascii", cells: [[3, 5, "."]] });
    await hand.tool("Rectangle");
    await hand.drag([0.75, 1.25], [1.75, 2.25]);
    expect(await edited(4)).toMatchObject({ cells: expect.objectContaining({ length: 8 }) });
    await hand.tool("Fill");
    await hand.click(1.25, 1.75);
    expect(await edited(5)).toEqual({ op: "paint", key: "map.ascii", cells: [[2, 2, "#"]] });
    for (let i = 0; i < 5; i++) await page.getByRole("button", { name: "Undo" }).click();
    await checked();
    expect(text()).toContain("#....#...#\n#........#\n##########");
    expect(await page.getByRole("button", { name: "Undo" }).isDisabled()).toBe(true);
    await page.keyboard.press("Control+y");
    await checked();
    expect(text()).toContain("#.#####..#");
    expect(consoleErrors).toEqual([]);
  });

  test("all tools and what is done to an item are reached at a width that has no room for them", async () => {
    await draws("robots", { width: 920 });
    await hand.tool("Select");
    await hand.click(1.5, 1);
    const remove = page.getByRole("group", { name: "Selected item" }).getByRole("button", { name: "Delete" });
    await remove.waitFor();
    await page.getByRole("group", { name: "Tools" }).hover();
    await page.mouse.wheel(2000, 0);
    const right_px = async (): Promise<number> => {
      const box = (await remove.boundingBox())!;
      const bar = (await page.locator(".bar", { has: remove }).boundingBox())!;
      return box.x + box.width - bar.x - bar.width;
    };
    await expect.poll(right_px).toBeLessThanOrEqual(0);
  });

  test("robots are placed, moved, rotated and removed; a door replaces a part of a wall", async () => {
    await draws("robots");
    await hand.tool("Robot");
    await hand.click(3.25, 1.75);
    expect(await edited(1)).toEqual({ op: "insert", key: "robots.0.at", at: null, value: [6, 3] });
    await hand.tool("Select");
    await hand.drag([1.5, 1], [2, 1]);
    expect(await edited(2)).toEqual({ op: "set", key: "robots.0.at.0", value: [3, 1] });
    await page.keyboard.press("r");
    expect(await edited(3)).toEqual({ op: "set", key: "robots.0.at.0", value: [3, 1, 0] });
    await hand.click(3.5, 2);
    await page.keyboard.press("Delete");
    expect(await edited(4)).toEqual({ op: "remove", key: "robots.0.at.1" });
    await hand.tool("Door");
    await hand.drag([4.75, 0.75], [4.75, 1.25]);
    await expect.poll(() => edits().length).toBe(6);
    expect(edits().slice(4)).toEqual([
      {
        op: "paint",
        key: "map.ascii",
        cells: [
          [4, 9, "."],
          [3, 9, "."],
        ],
      },
      {
        op: "insert",
        key: "doors",
        at: null,
        value: { at: [[9, 1]], size: [1, 2], periodic: { open: 60, closed: 20 } },
      },
    ]);
    await hand.tool("Way-point");
    await hand.click(2.25, 2.25);
    expect((await edited(7)).key).toBe("robots.0.behaviour");
  });

  test("all tools can be used by keys alone", async () => {
    await draws("robots");
    await page.locator("canvas.layer").focus();
    await page.keyboard.press("3");
    expect(await page.getByRole("button", { name: "Line", exact: true }).getAttribute("aria-pressed")).toBe("true");
    await page.keyboard.press("1");
    await page.keyboard.press("n");
    await page.keyboard.press("Enter");
    await page.keyboard.press("ArrowRight");
    await page.keyboard.press("ArrowUp");
    await page.keyboard.press("Enter");
    expect(await edited(1)).toEqual({ op: "set", key: "robots.0.at.0", value: [3, 2] });
    await page.keyboard.press("3");
    await page.keyboard.press("Enter");
    await page.keyboard.press("Shift+ArrowRight");
    await page.keyboard.press("Enter");
    expect(await edited(2)).toMatchObject({ op: "paint", key: "map.ascii" });
    await page.keyboard.press("1");
    await page.keyboard.press("n");
    await page.keyboard.press("Delete");
    expect(await edited(3)).toEqual({ op: "remove", key: "robots.0" });
  });

  /** Returns the points of the chosen thing and of the tips of its axes, once they differ from those before. */
  async function axes(before = ""): Promise<[number, number][]> {
    const layer = page.locator("canvas.layer");
    await page.waitForFunction((before) => {
      const axes = document.querySelector<HTMLElement>("canvas.layer")?.dataset.axes ?? "";
      return axes !== "" && axes !== before;
    }, before);
    return layer.evaluate((canvas: HTMLElement) => {
      const box = canvas.getBoundingClientRect();
      return canvas.dataset.axes!.split(" ").map((point) => {
        const [x, y] = point.split(",").map(Number) as [number, number];
        return [box.left + x, box.top + y] as [number, number];
      });
    });
  }

  async function pull([x, y]: [number, number], dx: number, dy: number): Promise<void> {
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + dx, y + dy, { steps: 6 });
    await page.mouse.up();
  }

  test("starts, targets and obstacles of chains in space move along axes, in the view and by keys, and back by undo", async () => {
    await draws("chain");
    await page.locator("canvas.layer").focus();
    await page.keyboard.press("n");
    const [, , , up] = await axes();
    const before = await page.locator("canvas.layer").getAttribute("data-axes");
    await pull(up!, 0, -80);
    const lifted = (await edited(1)) as { key: string; value: number[] };
    expect([lifted.key, lifted.value[0], lifted.value[1]]).toEqual(["obstacles.0.at_m", 1, 2]);
    expect(lifted.value[2]).toBeGreaterThan(0.6);
    // The next drag starts at its current position, as reported by the program.
    const [middle] = await axes(before!);
    await pull(middle!, 70, 0);
    const aside = (await edited(2)) as { key: string; value: number[] };
    expect(aside.key).toBe("obstacles.0.at_m");
    // The view is level: a thing moved sideways in it stays at its height.
    expect(aside.value[2]).toBeCloseTo(lifted.value[2]!, 1);
    expect(Math.hypot(aside.value[0]! - 1, aside.value[1]! - 2)).toBeGreaterThan(0.2);
    await page.locator("canvas.layer").focus();
    for (const name of ["obstacles.1.at_m", "chains.0.at_m", "chains.0.tasks.0.targets_m.0"]) {
      await page.keyboard.press("n");
      for (const key of ["Enter", "PageUp", "PageUp", "Enter"]) await page.keyboard.press(key);
      await expect.poll(() => edits().at(-1)?.key, { timeout: 30_000 }).toBe(name);
      await checked();
    }
    for (let i = 0; i < 5; i++) await page.getByRole("button", { name: "Undo" }).click();
    await checked();
    expect(text()).toContain("at_m = [1.0, 2.0, 0.5]");
    expect(await page.getByRole("button", { name: "Undo" }).isDisabled()).toBe(true);
    await page.screenshot({ path: "screenshots/edit-space-1280.png" });
    expect(consoleErrors).toEqual([]);
  });

  test("routes of airplanes are drawn and moved", async () => {
    await draws("airspace");
    await hand.drag([-4000, 0], [-3000, 2000]);
    const moved = await edited(1);
    expect(moved).toMatchObject({ op: "set", key: "airplanes.0.at_m" });
    const [x, y] = (moved as { value: number[] }).value;
    expect(Math.hypot(x! + 3000, y! - 2000)).toBeLessThan(60);
    await hand.tool("Way-point");
    await hand.click(2000, -3000);
    expect(await edited(2)).toMatchObject({ op: "insert", key: "airplanes.0.way_points_m" });
    await hand.tool("Airplane");
    await hand.drag([-2000, -2000], [-2000, 3000]);
    expect(await edited(3)).toMatchObject({ op: "insert", key: "airplanes", value: { heading_deg: 90 } });
  });

  test("playing ends editing, and Run plays", async () => {
    await draws("robots");
    await page.getByRole("button", { name: "Run", exact: true }).click();
    await page.getByRole("button", { name: "Pause" }).waitFor();
    expect(await page.locator("canvas.layer").count()).toBe(0);
    await page.keyboard.press("e");
    await page.locator("canvas.layer").waitFor();
    await page.getByTestId("state").filter({ hasText: "paused" }).waitFor();
  });
});

describe("a new drawing", () => {
  test("starts with surrounding walls, one robot and the brush", async () => {
    ({ page, consoleErrors } = await openPage(browser, server.url));
    hand = new PointerDriver(page);
    await page.getByRole("button", { name: "Draw a new one…" }).click();
    const dialog = page.getByRole("dialog", { name: "Draw a new scenario of robots" });
    await dialog.getByLabel("Columns").fill("3");
    await dialog.getByText("from 5").waitFor();
    await dialog.getByLabel("Columns").fill("20");
    await dialog.getByLabel("Rows", { exact: true }).fill("10");
    await dialog.getByText("5 m by 2.5 m").waitFor();
    await dialog.getByRole("button", { name: "Draw" }).click();
    await page.locator("canvas.layer").waitFor();
    await checked();
    expect(text()).toContain(`${"#".repeat(20)}\n#${".".repeat(18)}#`);
    expect(text()).toContain("at = [[9, 4]]");
    expect(await page.getByRole("button", { name: "Brush", exact: true }).getAttribute("aria-pressed")).toBe("true");
    expect(consoleErrors).toEqual([]);
  });
});

describe("forms", () => {
  test("a field yields one edit, shows its problem, and undo works across all views", async () => {
    await visit("robots");
    await page.getByRole("tab", { name: "Forms" }).click();
    await page.getByRole("button", { name: "robots 1: couriers" }).click();
    const size = page.getByLabel("size", { exact: true });
    await size.fill("2.5");
    await size.press("Enter");
    await page.getByText("write a whole number").waitFor();
    expect(await size.getAttribute("aria-invalid")).toBe("true");
    await size.fill("3");
    await size.press("Enter");
    expect(await edited(1)).toEqual({ op: "set", key: "robots.0.size", value: 3 });
    await page.getByLabel("regime").selectOption("reliable");
    expect(await edited(2)).toEqual({ op: "set", key: "robots.0.regime", value: "reliable" });
    await page.getByRole("button", { name: "echo ✕" }).click();
    expect(await edited(3)).toEqual({ op: "remove", key: "robots.0.sensors" });
    await page.getByRole("button", { name: "Duplicate robots.0", exact: true }).click();
    expect(await edited(4)).toMatchObject({ op: "insert", key: "robots", at: 1 });
    await page.getByRole("heading", { name: "robots 2: couriers" }).waitFor();
    await page.getByRole("button", { name: "Move robots.1 up" }).click();
    expect(await edited(5)).toEqual({ op: "move", key: "robots.1", to: 0 });
    await page.getByRole("button", { name: "Remove robots.0", exact: true }).click();
    expect(await edited(6)).toEqual({ op: "remove", key: "robots.0" });
    await page.getByLabel("Add a section").selectOption("record");
    expect(await edited(7)).toEqual({ op: "set", key: "record", value: {} });
    await page.getByLabel("events", { exact: true }).selectOption("false");
    expect(await edited(8)).toEqual({ op: "set", key: "record.events", value: false });
    // Two equal sections that change places change nothing: that was no step.
    for (let i = 0; i < 7; i++) await page.getByRole("button", { name: "Undo" }).click();
    await checked();
    expect(await page.getByRole("button", { name: "Undo" }).isDisabled()).toBe(true);
    expect(text()).toContain("# A made-up scenario.");
    expect(consoleErrors).toEqual([]);
  });

  test("a matrix sums its rows during typing, marks wrong ones, and scales them", async () => {
    await visit("robots");
    await page.getByRole("tab", { name: "Forms" }).click();
    await page.getByRole("button", { name: "sensors: echo" }).click();
    const cell = page.getByRole("textbox", { name: "wall, wall" });
    await cell.fill("0.6");
    expect(await page.getByLabel("Sum of wall").textContent()).toBe("0.8");
    expect(edits()).toEqual([]);
    await cell.press("Enter");
    await checked("1 problem");
    expect(edits()).toEqual([{ op: "set", key: "sensors.echo.confusion.wall.1", value: 0.6 }]);
    expect(await cell.getAttribute("aria-invalid")).toBe("true");
    await page.getByRole("cell", { name: /the row sums to 0.8/ }).waitFor();
    const hidden_px = await page
      .getByRole("list", { name: "Problems" })
      .evaluate((list) => list.scrollHeight - list.clientHeight);
    expect(hidden_px, "a problem is not cut").toBe(0);
    await page.getByRole("button", { name: "Scale the row wall to 1" }).click();
    expect(await edited(2)).toEqual({ op: "set", key: "sensors.echo.confusion.wall", value: [0.125, 0.75, 0.125] });
    expect(await page.getByLabel("Sum of wall").textContent()).toBe("1");
  });

  test("a unit is separated from its key, and all stays visible in a narrow window", async () => {
    await visit("robots");
    await page.getByRole("tab", { name: "Forms" }).click();
    await page.getByRole("button", { name: "map", exact: true }).click();
    await page.getByText("box_size_m (m)", { exact: true }).waitFor();
    await page.getByRole("tab", { name: "View" }).click();
    await page.getByRole("button", { name: "Edit", exact: true }).click();
    const mPerPx = (): Promise<number> =>
      page.locator("canvas.layer").evaluate((canvas: HTMLElement) => Number(canvas.dataset.camera?.split(" ")[2] ?? 0));
    await expect.poll(mPerPx, { timeout: WAIT_MS }).toBeGreaterThan(0);
    const wide = await mPerPx();
    await page.setViewportSize({ width: 400, height: 800 });
    await expect.poll(mPerPx, { timeout: WAIT_MS }).toBeGreaterThan(1.2 * wide);
  });

  test("a click on a problem opens its field", async () => {
    await visit("robots");
    await page.getByRole("tab", { name: "Forms" }).click();
    await page.getByRole("button", { name: "sensors: echo" }).click();
    await page.getByRole("textbox", { name: "robot, robot" }).fill("0.1");
    await page.keyboard.press("Tab");
    await checked("1 problem");
    await page.getByRole("button", { name: "map", exact: true }).click();
    await page.getByRole("list", { name: "Problems" }).getByRole("button").click();
    await page.getByRole("textbox", { name: "robot, nothing" }).and(page.locator(":focus")).waitFor();
  });
});

describe("text", () => {
  test("problems are marked over their whole span, and keys are completed from the schema", async () => {
    await visit("robots");
    await page.getByRole("tab", { name: "Text" }).click();
    const box = page.getByRole("textbox", { name: "Text of the scenario" });
    await checked();
    await box.click();
    await page.keyboard.press("Control+End");
    await page.keyboard.type("reg");
    const list = page.getByRole("listbox");
    await list.getByRole("option", { name: "regime" }).waitFor();
    await list.getByRole("option", { name: "region" }).waitFor();
    await page.getByText("Whose errors are on.").waitFor();
    await page.keyboard.press("Escape");
    for (let i = 0; i < 3; i++) await page.keyboard.press("Backspace");
    await page.keyboard.type("cuont = 3");
    await checked("1 problem");
    expect(await page.locator(".cm-lintRange-error").textContent()).toBe("cuont");
    await page.keyboard.press("Control+z");
    await checked();
    expect(text().endsWith("size = 2\n")).toBe(true);
    expect(consoleErrors).toEqual([]);
  });

  test("drawn changes appear in the text, and typed ones in the view", async () => {
    await draws("robots");
    await hand.tool("Robot");
    await hand.click(3.25, 1.75);
    await edited(1);
    await page.getByRole("tab", { name: "Text" }).click();
    await page.locator(".cm-line", { hasText: "at = [ [ 2, 1 ], [ 6, 3 ] ]" }).waitFor();
  });
});

describe("saving", () => {
  test("a new scenario asks for its file, a saved one does not, and leaving unsaved changes asks", async () => {
    await draws("robots");
    await hand.tool("Robot");
    await hand.click(3.25, 1.75);
    await edited(1);
    await page.getByRole("toolbar", { name: "Editing" }).getByText("changed, not saved").waitFor();
    await page.keyboard.press("Control+s");
    const dialog = page.getByRole("dialog", { name: "Save as" });
    await dialog.getByRole("button", { name: "more/" }).click();
    await dialog.getByLabel("Name").fill("mine");
    await dialog.getByRole("button", { name: "Save", exact: true }).click();
    await expect
      .poll(() => server.calls.findLast((call) => call.do === "save"))
      .toMatchObject({ to: "more/mine.toml", overwrite: false });
    await dialog.waitFor({ state: "detached" });
    await hand.click(2.25, 2.25);
    await edited(2);
    await page.keyboard.press("Control+s");
    await expect.poll(() => server.calls.filter((call) => call.do === "save").length).toBe(2);
    expect(server.calls.findLast((call) => call.do === "save")).toMatchObject({
      to: "more/mine.toml",
      overwrite: false,
    });
    await hand.click(1.25, 2.25);
    await edited(3);
    const asked = new Promise<string>((resolve) =>
      page.once("dialog", (one) => void one.dismiss().then(() => resolve(one.type()))),
    );
    await page.getByRole("button", { name: "Close Made-up hall" }).click();
    expect(await asked).toBe("confirm");
    expect(await page.locator("canvas.layer").count()).toBe(1);
    const left = new Promise<string>((resolve) =>
      page.once("dialog", (one) => void one.dismiss().then(() => resolve(one.type()))),
    );
    await page.close({ runBeforeUnload: true });
    expect(await left).toBe("beforeunload");
  });

  test("a file that was changed meanwhile is compared, and either text can be kept", async () => {
    ({ page, consoleErrors } = await openPage(browser, server.url));
    hand = new PointerDriver(page);
    await page.getByRole("button", { name: "Open…", exact: true }).click();
    await page.getByRole("button", { name: /^robots\.toml/ }).click();
    await page.locator(".view").waitFor();
    await page.getByRole("tab", { name: "Text" }).click();
    await checked();
    await page.getByRole("textbox", { name: "Text of the scenario" }).click();
    await page.keyboard.press("Control+Home");
    await page.keyboard.type("# mine\n");
    await checked();
    server.theirs = "# theirs\nformat = 1\n";
    await page.keyboard.press("Control+s");
    const dialog = page.getByRole("dialog", { name: /was changed/ });
    await dialog.locator(".mine", { hasText: "# mine" }).waitFor();
    await dialog.locator(".theirs", { hasText: "# theirs" }).waitFor();
    await dialog.getByRole("button", { name: "Take the file's" }).click();
    await page.locator(".cm-line", { hasText: "# theirs" }).waitFor();
    await page.keyboard.press("Control+z");
    await page.locator(".cm-line", { hasText: "# mine" }).waitFor();
    await page.keyboard.press("Control+s");
    await dialog.getByRole("button", { name: "Keep mine" }).click();
    await expect.poll(() => server.calls.findLast((call) => call.do === "save")).toMatchObject({ overwrite: true });
    await dialog.waitFor({ state: "detached" });
  });
});
