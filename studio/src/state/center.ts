/** The panels that the center of the page can show. */

import type { Session } from "./session.svelte";

export type Center = "view" | "forms" | "text" | "report";

/** The panels of a session: a fleet has no text here, and only a recording in a folder has a report. */
export function centersOf({ isFleet, folder }: Pick<Session, "isFleet" | "folder">): readonly Center[] {
  if (isFleet) return ["view"];
  return folder === null ? ["view", "forms", "text"] : ["view", "forms", "text", "report"];
}

/** The panel that is shown of a session where the page is to show this one: the picture, if the session has no such panel. */
export function centerOf(session: Pick<Session, "isFleet" | "folder">, wanted: Center): Center {
  return centersOf(session).includes(wanted) ? wanted : "view";
}
