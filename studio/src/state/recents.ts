/** Targets opened before, stored by the browser. */

import type { OpenTarget } from "../protocol";

const KEY = "sidestep.recent";
const MAX_RECENTS = 8;

export interface Recent {
  target: OpenTarget;
  name: string;
}

export function recents(): Recent[] {
  try {
    const stored: unknown = JSON.parse(localStorage.getItem(KEY) ?? "[]");
    // Entries of an earlier version of the page have no target.
    return Array.isArray(stored) ? (stored as Recent[]).filter((one) => one.target).slice(0, MAX_RECENTS) : [];
  } catch {
    return [];
  }
}

export function remember(target: OpenTarget, name: string): void {
  const same = JSON.stringify(target);
  const others = recents().filter((one) => JSON.stringify(one.target) !== same);
  try {
    localStorage.setItem(KEY, JSON.stringify([{ target, name }, ...others].slice(0, MAX_RECENTS)));
  } catch {
    // A browser without storage still opens everything.
  }
}
