/** Addresses of results that the server makes of recordings and sweeps: reports and exports. */

import { makeProblem } from "../connection";
import type { Problem, SweepRun } from "../protocol";

function address(route: string, fields: Record<string, string | number | undefined>): string {
  const given = Object.entries(fields).filter(([, value]) => value !== undefined);
  return `/${route}?${given.map(([name, value]) => `${name}=${encodeURIComponent(String(value))}`).join("&")}`;
}

/** The report of a folder, or a part of it: `html`, `markdown`, `figures`, or the name of a figure. */
export function reportAddress(path: string, part?: string): string {
  return address("report", { path, as: part });
}

/** Parses the server's error: place, cause, and help on a line of its own. */
export function parseFailure(path: string, text: string): Problem {
  const [, place, cause, help] = /^(.*?): ([^]*?)(?:\nhelp: ([^]*))?$/.exec(text.trim()) ?? [];
  if (cause === undefined || help === undefined)
    return makeProblem(path, text.trim() || "the server returned no report", "try again");
  return makeProblem(place || path, cause, help);
}

/** A run requested in the page of a report: a variant by name or number, and a seed or none. */
export interface RunRequest {
  variant: string;
  seed: string | null;
}

/** Parses the message of a report's page that requests a run; null for any other message. */
export function parseRunRequest(data: unknown): RunRequest | null {
  const { opens } = (data ?? {}) as { opens?: Partial<RunRequest> };
  if (typeof opens !== "object" || opens === null || typeof opens.variant !== "string") return null;
  return { variant: opens.variant, seed: typeof opens.seed === "string" ? opens.seed : null };
}

/** Finds the requested run, by the variant's name or its number among the names; the first one if no seed is given. */
export function findRun(runs: readonly SweepRun[], { variant, seed }: RunRequest): SweepRun | undefined {
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

/** Downloads data made by the page. */
export function saveFile(blob: Blob, name: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** A file name that needs no quoting anywhere. */
export function safeFileName(name: string): string {
  return name.replace(/[^\w.-]+/g, "-").replace(/^[-.]+|-+$/g, "") || "sidestep";
}
