/** Subjects opened before, kept by the browser. */

import type { Subject } from "../protocol";

const KEY = "sidestep.recent";
const MOST = 8;

export interface Recent {
  subject: Subject;
  name: string;
}

export function recents(): Recent[] {
  try {
    const kept: unknown = JSON.parse(localStorage.getItem(KEY) ?? "[]");
    return Array.isArray(kept) ? (kept as Recent[]).slice(0, MOST) : [];
  } catch {
    return [];
  }
}

export function remember(subject: Subject, name: string): void {
  const same = JSON.stringify(subject);
  const others = recents().filter((one) => JSON.stringify(one.subject) !== same);
  try {
    localStorage.setItem(KEY, JSON.stringify([{ subject, name }, ...others].slice(0, MOST)));
  } catch {
    // A browser that keeps nothing still opens everything.
  }
}
