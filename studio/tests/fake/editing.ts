/** The editing that the worlds of the program declare. */

import { readFileSync } from "node:fs";
import { editingOf, type Editing } from "../../src/edit/editing";

const ALL: Record<string, unknown> = JSON.parse(
  readFileSync(new URL("./editing.json", import.meta.url), "utf8"),
) as Record<string, unknown>;

/** Returns the editing of a world; that of robots for a made-up one, which cannot be begun by drawing. */
export function declaredEditing(world: string): Editing {
  const declared = ALL[world];
  return declared === undefined ? { ...editingOf(ALL["robots"]), drawing: null } : editingOf(declared);
}
