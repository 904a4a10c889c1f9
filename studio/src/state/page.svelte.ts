/** Settings of the page itself: theme, width, open panels. */

import type { FileEntry } from "../protocol";
import type { Center } from "./center";

export type ThemeChoice = "auto" | "light" | "dark";

function readStored(key: string): string | null {
  try {
    return localStorage.getItem(`sidestep.${key}`);
  } catch {
    return null;
  }
}

function store(key: string, value: string): void {
  try {
    localStorage.setItem(`sidestep.${key}`, value);
  } catch {
    // A browser without storage starts with defaults each time.
  }
}

/** Below this width panels become tabs below the canvas. */
const NARROW_QUERY = "(max-width: 899px)";

class Page {
  theme = $state<ThemeChoice>((readStored("theme") as ThemeChoice | null) ?? "auto");
  isNarrow = $state(matchMedia(NARROW_QUERY).matches);
  showsCharts = $state(readStored("charts") !== "no");
  /** Whether single letters act on the page. */
  hasKeys = $state(readStored("keys") !== "no");
  showsHelp = $state(false);
  showsOpen = $state(false);
  showsExports = $state(false);
  /** Width of the inspector. */
  inspector_px = $state(Math.min(720, Math.max(220, Number(readStored("inspector") ?? 330))));
  /** The panel below the canvas on narrow screens. */
  tab = $state<"agents" | "events" | "inspector" | "charts">("agents");
  /** The panel that the center shows, for sessions that have it (`centerOf`). */
  center = $state<Center>("view");
  /** Whether the canvas is being edited. */
  edits = $state(false);
  showsNew = $state(false);
  /** The map that a new scenario is about to be made on. */
  map = $state.raw<FileEntry | null>(null);
  /** Counts requests by keys to focus the filter; the panel reacts to changes. */
  filterRequests = $state(0);
  #systemIsDark = $state(matchMedia("(prefers-color-scheme: dark)").matches);

  constructor() {
    matchMedia(NARROW_QUERY).addEventListener("change", (event) => (this.isNarrow = event.matches));
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
    store("theme", this.theme);
  }

  widenInspector(by_px: number): void {
    this.inspector_px = Math.min(720, Math.max(220, this.inspector_px + by_px));
    store("inspector", String(this.inspector_px));
  }

  toggleCharts(): void {
    this.showsCharts = !this.showsCharts;
    store("charts", this.showsCharts ? "yes" : "no");
  }

  toggleKeys(): void {
    this.hasKeys = !this.hasKeys;
    store("keys", this.hasKeys ? "yes" : "no");
  }
}

export const page = new Page();
