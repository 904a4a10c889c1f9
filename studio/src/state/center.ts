/** What the center of the page shows. */

import type { Session } from "./session.svelte";

export type Center = "view" | "forms" | "text" | "report";

/** What there is of a session: a fleet has no text here, and only what was recorded to a folder has a report. */
export function centersOf({ isFleet, folder }: Pick<Session, "isFleet" | "folder">): readonly Center[] {
  if (isFleet) return ["view"];
  return folder === null ? ["view", "forms", "text"] : ["view", "forms", "text", "report"];
}

/** What is shown of a session where the page is to show this: the picture, if there is no such thing of it. */
export function centerOf(session: Pick<Session, "isFleet" | "folder">, wanted: Center): Center {
  return centersOf(session).includes(wanted) ? wanted : "view";
}
