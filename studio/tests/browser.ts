/** Chromium and pages for tests. */

import { chromium, type Browser, type Page } from "playwright-core";

/** Maximum wait: software rendering is slow on a busy machine. */
export const WAIT_MS = Number(process.env.WAIT_MS ?? 60_000);

/** Widths and whether it is dark, for what looks the same in others; MANY=1 for all of them. */
export const LOOKS: readonly (readonly [number, boolean])[] = process.env.MANY
  ? [
      [1280, false],
      [1280, true],
      [400, false],
      [400, true],
    ]
  : [
      [1280, false],
      [400, true],
    ];

export function launch(): Promise<Browser> {
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    headless: true,
    args: [
      "--no-sandbox",
      "--disable-quic",
      "--no-first-run",
      "--disable-background-networking",
      "--disable-component-update",
      "--disable-sync",
      "--use-angle=swiftshader",
      "--enable-unsafe-swiftshader",
    ],
  });
}

export interface PageOptions {
  width?: number;
  height?: number;
  isDark?: boolean;
}

/** Opens the page and collects its errors in `consoleErrors`. */
export async function openPage(
  browser: Browser,
  url: string,
  look: PageOptions = {},
): Promise<{ page: Page; consoleErrors: string[] }> {
  const context = await browser.newContext({
    viewport: { width: look.width ?? 1280, height: look.height ?? 800 },
    colorScheme: look.isDark ? "dark" : "light",
    reducedMotion: "reduce",
  });
  const page = await context.newPage();
  page.setDefaultTimeout(WAIT_MS);
  const consoleErrors: string[] = [];
  page.on("console", (message) => {
    if (message.type() === "error" || message.type() === "warning") consoleErrors.push(message.text());
  });
  page.on("pageerror", (error) => consoleErrors.push(String(error)));
  await page.goto(url);
  return { page, consoleErrors };
}

/** Waits until the view shows a frame that has been requested by now. */
export async function drawn(page: Page): Promise<void> {
  await page.waitForFunction(() => Number(document.querySelector<HTMLElement>(".view")?.dataset.pictures ?? 0) > 1);
}

/** Opens a new scenario with the defaults of a world. */
export async function openNew(page: Page, world: string): Promise<void> {
  await page.getByRole("button", { name: world, exact: true }).first().click();
  await drawn(page);
}
