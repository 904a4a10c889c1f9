/** The page's display settings of one session. */

import type { ColorMode, DensityMode } from "./color-mode";

export type TrailMode = "none" | "selected" | "all";

/** How traffic in space is shown: from above with altitudes in words, or in perspective. */
export type Projection = "plan" | "space";

export class Display {
  trails = $state<TrailMode>("selected");
  /** Whether lines are drawn at their true width. */
  widthIsTrue = $state(false);
  projection = $state<Projection>("plan");
  /** Whether a plan has a vertical profile below it. */
  hasProfile = $state(true);
  /** Whether the view follows the selected body. */
  follows = $state(false);
  /** What the colors of bodies stand for. */
  colors = $state<ColorMode>("own");
  density = $state<DensityMode>("auto");
  /** Cycle under the pointer in the timeline or a chart. */
  cursor = $state<number | null>(null);
}
