/** Searches events for words, as the server does: see its `event_search.rs`. */

import { bodyLabel } from "../format";
import type { BodyId, ReplyBody, RunEvent } from "../protocol";

/** A search for events. */
export interface EventQuery {
  text: string;
  kinds: readonly string[] | null;
  skip: number;
  limit: number;
}

/** Returns the reply to a search; `leftOut` events were not kept. */
export function findEvents(
  events: readonly RunEvent[],
  query: EventQuery,
  names: ReadonlyMap<string, string>,
  leftOut: number,
): ReplyBody {
  const words = query.text.toLowerCase().split(/\s+/).filter(Boolean);
  const counts = new Map<string, number>();
  const entries: RunEvent[] = [];
  let found = 0;
  for (const event of events) {
    counts.set(event.kind, (counts.get(event.kind) ?? 0) + 1);
    if (query.kinds !== null && !query.kinds.includes(event.kind)) continue;
    if (!hasWords(event, words, names)) continue;
    found++;
    if (found > query.skip && entries.length < query.limit) entries.push(event);
  }
  const kinds = [...counts].sort(([a], [b]) => (a < b ? -1 : 1));
  return { is: "found-events", entries, found, searched: events.length, left_out: leftOut, kinds };
}

/** Returns whether an event has all words, given in lowercase letters. */
function hasWords(event: RunEvent, words: readonly string[], names: ReadonlyMap<string, string>): boolean {
  if (words.length === 0) return true;
  const bodies = [event.body, event.other].map((body) => (body ? bodyWords(body, names) : ""));
  const text = `${event.kind} ${event.text} ${bodies.join(" ")}`.toLowerCase();
  return words.every((word) => text.includes(word));
}

function bodyWords(body: BodyId, names: ReadonlyMap<string, string>): string {
  return `${names.get(`${body.kind} ${body.number}`) ?? ""} ${bodyLabel(body)}`;
}
