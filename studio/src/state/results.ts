/** Addresses at which the server makes results of recordings and sweeps: reports and exports. */

import { problemOf } from "../connection";
import type { Problem, SweepRun } from "../protocol";

function address(route: string, fields: Record<string, string | number | undefined>): string {
  const given = Object.entries(fields).filter(([, value]) => value !== undefined);
  return `/${route}?${given.map(([name, value]) => `${name}=${encodeURIComponent(String(value))}`).join("&")}`;
}

/** The report of a folder, or a part of it: `html`, `markdown`, `figures`, or the name of a figure. */
export function reportAddress(path: string, part?: string): string {
  return address("report", { path, as: part });
}

/** The reason why there is no result, as the server has said it: place, cause, and help on a line of its own. */
export function failureOf(path: string, said: string): Problem {
  const [, place, cause, help] = /^(.*?): ([^]*?)(?:\nhelp: ([^]*))?$/.exec(said.trim()) ?? [];
  if (cause === undefined || help === undefined)
    return problemOf(path, said.trim() || "the server gives no report", "try it again");
  return problemOf(place || path, cause, help);
}

/** A run that was asked for in the page of a report: a variant by its name or its number, and a seed or none. */
export interface WantedRun {
  variant: string;
  seed: string | null;
}

/** The run that a message of a report's page asks for; anything else is no concern of ours. */
export function wantedRun(data: unknown): WantedRun | null {
  const { opens } = (data ?? {}) as { opens?: Partial<WantedRun> };
  if (typeof opens !== "object" || opens === null || typeof opens.variant !== "string") return null;
  return { variant: opens.variant, seed: typeof opens.seed === "string" ? opens.seed : null };
}

/** The run that is asked for: of a variant's name, or of its number among the names; the first if no seed is named. */
export function foundRun(runs: readonly SweepRun[], { variant, seed }: WantedRun): SweepRun | undefined {
  const names = [...new Set(runs.map((run) => run.variant))];
  const name = names.includes(variant) ? variant : /^\d+$/.test(variant) ? names[Number(variant)] : undefined;
  return runs.find((run) => run.variant === name && (seed === null || run.seed === seed));
}

export interface Export {
  /** A format of `sidestep export`. */
  form: string;
  table?: string;
  cycle?: number;
}

export function exportAddress(path: string, { form, table, cycle }: Export): string {
  return address("export", { path, as: form, table, cycle });
}

/** Keeps data made here as a file. */
export function keepFile(blob: Blob, name: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** A name of a file that needs no quoting anywhere. */
export function plainName(name: string): string {
  return name.replace(/[^\w.-]+/g, "-").replace(/^[-.]+|-+$/g, "") || "sidestep";
}
