/** The page's display settings of one session. */

import type { ColorMode, DensityMode } from "./color-mode";

export type TrailMode = "none" | "selected" | "all";

export class Display {
  trails = $state<TrailMode>("selected");
  /** Whether lines are drawn at their true width. */
  widthIsTrue = $state(false);
  /** Whether the view follows the selected body. */
  follows = $state(false);
  /** What the colors of bodies stand for. */
  colors = $state<ColorMode>("own");
  density = $state<DensityMode>("auto");
  /** Cycle under the pointer in the timeline or a chart. */
  cursor = $state<number | null>(null);
}
