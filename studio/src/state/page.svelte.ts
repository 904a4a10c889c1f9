/** Choices of the page as such: theme, width, open panels. */

import type { Center } from "./center";

export type ThemeChoice = "auto" | "light" | "dark";

function kept(key: string): string | null {
  try {
    return localStorage.getItem(`sidestep.${key}`);
  } catch {
    return null;
  }
}

function keep(key: string, value: string): void {
  try {
    localStorage.setItem(`sidestep.${key}`, value);
  } catch {
    // A browser that keeps nothing begins anew each time.
  }
}

/** Below this width panels become tabs below the canvas. */
const NARROW = "(max-width: 899px)";

class Page {
  theme = $state<ThemeChoice>((kept("theme") as ThemeChoice | null) ?? "auto");
  isNarrow = $state(matchMedia(NARROW).matches);
  showsCharts = $state(kept("charts") !== "no");
  /** Single letters act on the page, unless switched off. */
  hasKeys = $state(kept("keys") !== "no");
  showsHelp = $state(false);
  showsOpen = $state(false);
  showsExports = $state(false);
  /** Width of the inspector. */
  inspector_px = $state(Math.min(720, Math.max(220, Number(kept("inspector") ?? 330))));
  /** The panel below the canvas on narrow screens. */
  tab = $state<"agents" | "events" | "inspector" | "charts">("agents");
  /** The view that the center is to show, of sessions that have it (`centerOf`). */
  center = $state<Center>("view");
  /** Whether the picture is drawn upon. */
  edits = $state(false);
  showsNew = $state(false);
  /** Requests by keys, counted; the panels listen. */
  wantsFilter = $state(0);
  #systemIsDark = $state(matchMedia("(prefers-color-scheme: dark)").matches);

  constructor() {
    matchMedia(NARROW).addEventListener("change", (event) => (this.isNarrow = event.matches));
    matchMedia("(prefers-color-scheme: dark)").addEventListener(
      "change",
      (event) => (this.#systemIsDark = event.matches),
    );
  }

  get isDark(): boolean {
    return this.theme === "auto" ? this.#systemIsDark : this.theme === "dark";
  }

  switchTheme(): void {
    this.theme = this.isDark ? "light" : "dark";
    keep("theme", this.theme);
  }

  widenInspector(by_px: number): void {
    this.inspector_px = Math.min(720, Math.max(220, this.inspector_px + by_px));
    keep("inspector", String(this.inspector_px));
  }

  toggleCharts(): void {
    this.showsCharts = !this.showsCharts;
    keep("charts", this.showsCharts ? "yes" : "no");
  }

  toggleKeys(): void {
    this.hasKeys = !this.hasKeys;
    keep("keys", this.hasKeys ? "yes" : "no");
  }
}

export const page = new Page();
