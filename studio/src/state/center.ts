/** The panels that the center of the page can show. */

import type { Session } from "./session.svelte";

export type Center = "view" | "forms" | "text" | "report";

/** The panels of a session: a fleet has no text here, and only a recording in a folder has a report. */
export function centersOf({ isFleet, folder }: Pick<Session, "isFleet" | "folder">): readonly Center[] {
  if (isFleet) return ["view"];
  return folder === null ? ["view", "forms", "text"] : ["view", "forms", "text", "report"];
}

/** The panel to show for a session: the requested one, or the view if the session does not have it. */
export function centerOf(session: Pick<Session, "isFleet" | "folder">, wanted: Center): Center {
  return centersOf(session).includes(wanted) ? wanted : "view";
}
