/** The runs in one chart: their names, and lines that are told apart in every theme, on paper, and without colors. */

import type { CurveStyle } from "./plot";

/** Blue, vermilion, green and purple of Okabe and Ito, and the same for dark pages, as in figures. */
const LIGHT = ["#0072B2", "#D55E00", "#009E73", "#CC79A7"] as const;
const DARK = ["#3D9FE0", "#F07F3C", "#2FC79A", "#E3A0C6"] as const;
const DASHES: readonly (readonly number[])[] = [[], [7, 4], [2, 3], [7, 3, 2, 3]];

/** The styles of the lines of so many runs; a single one has the color of text. */
export function curveStyles(count: number, isDark: boolean, ink: string): CurveStyle[] {
  if (count === 1) return [{ color: ink, dash: [] }];
  const colors = isDark ? DARK : LIGHT;
  return Array.from({ length: count }, (_, i) => ({
    color: colors[i % colors.length]!,
    dash: DASHES[i % DASHES.length]!,
  }));
}

/** A run by its name and seed. */
export interface RunName {
  name: string;
  seed: string;
}

/** The shortest names that tell runs apart: those of scenarios, with seeds, or with numbers. */
export function runLabels(runs: readonly RunName[]): string[] {
  const areDistinct = (labels: readonly string[]): boolean => new Set(labels).size === labels.length;
  const names = runs.map(({ name }) => name);
  if (areDistinct(names)) return names;
  const seeds = runs.map(({ name, seed }) => `${name}, seed ${seed}`);
  return areDistinct(seeds) ? seeds : seeds.map((label, i) => `${i + 1}: ${label}`);
}
