/** The panels that the center of the page can show. */

import type { Session } from "./session.svelte";

export type Center = "view" | "forms" | "text" | "report";

type Shown = Pick<Session, "isFleet" | "folder"> & { isReplay?: boolean };

/**
 * The panels of a session: a fleet has no text here, a replay in one file cannot be edited, and only a recording in a
 * folder has a report.
 */
export function centersOf({ isFleet, folder, isReplay }: Shown): readonly Center[] {
  if (isFleet) return ["view"];
  if (isReplay) return ["view", "text"];
  return folder === null ? ["view", "forms", "text"] : ["view", "forms", "text", "report"];
}

/** The panel to show for a session: the requested one, or the view if the session does not have it. */
export function centerOf(session: Shown, wanted: Center): Center {
  return centersOf(session).includes(wanted) ? wanted : "view";
}
