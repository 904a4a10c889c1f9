/** Targets opened before, stored by the browser, each with its time and a small picture. */

import type { OpenTarget } from "../protocol";

const KEY = "sidestep.recent";
/** Number of targets; pictures of all of them fit into what browsers store. */
const MAX_RECENTS = 12;
/** Longest picture, as the text of an address. */
const MAX_PICTURE_LENGTH = 40_000;

export interface Recent {
  target: OpenTarget;
  name: string;
  /** When it was opened last, in ISO 8601; missing in entries of an earlier version of the page. */
  opened?: string;
  /** A picture of it, as an address with data. */
  picture?: string;
}

export function recents(): Recent[] {
  try {
    const stored: unknown = JSON.parse(localStorage.getItem(KEY) ?? "[]");
    // Entries of an earlier version of the page have no target.
    return Array.isArray(stored) ? (stored as Recent[]).filter((one) => one?.target).slice(0, MAX_RECENTS) : [];
  } catch {
    return [];
  }
}

function isSame(a: OpenTarget, b: OpenTarget): boolean {
  return JSON.stringify(a) === JSON.stringify(b);
}

function store(list: Recent[]): void {
  try {
    localStorage.setItem(KEY, JSON.stringify(list.slice(0, MAX_RECENTS)));
  } catch {
    // A browser without storage still opens everything.
  }
}

/** Puts a target first; its picture stays until there is a new one. */
export function remember(target: OpenTarget, name: string, now = new Date()): void {
  const all = recents();
  const picture = all.find((one) => isSame(one.target, target))?.picture;
  const others = all.filter((one) => !isSame(one.target, target));
  const entry: Recent = { target, name, opened: now.toISOString(), ...(picture === undefined ? {} : { picture }) };
  store([entry, ...others]);
}

/** Keeps a picture of a target that is remembered. */
export function rememberPicture(target: OpenTarget, picture: string): void {
  if (picture.length > MAX_PICTURE_LENGTH || !picture.startsWith("data:image/")) return;
  store(recents().map((one) => (isSame(one.target, target) ? { ...one, picture } : one)));
}

/** Forgets a target. */
export function forget(target: OpenTarget): void {
  store(recents().filter((one) => !isSame(one.target, target)));
}

/** The place of a target, in words. */
export function placeOf(target: OpenTarget): string {
  if (target.kind === "new") return `defaults of ${target.world}`;
  return target.kind === "shipped" ? `shipped: ${target.name}` : target.path;
}

const TIME: Intl.DateTimeFormatOptions = { hour: "2-digit", minute: "2-digit", hourCycle: "h23" };

/** When a target was opened, as briefly as can be understood: today the time, else the day. */
export function lastUseText(lastUse: string | undefined, now = new Date()): string {
  const then = new Date(lastUse ?? "");
  if (Number.isNaN(then.getTime())) return "";
  if (then.toDateString() === now.toDateString()) return `today ${then.toLocaleTimeString("en-US", TIME)}`;
  const yesterday = new Date(now);
  yesterday.setDate(now.getDate() - 1);
  if (then.toDateString() === yesterday.toDateString()) return `yesterday ${then.toLocaleTimeString("en-US", TIME)}`;
  const year: Intl.DateTimeFormatOptions = then.getFullYear() === now.getFullYear() ? {} : { year: "numeric" };
  return then.toLocaleDateString("en-US", { month: "short", day: "numeric", ...year });
}
