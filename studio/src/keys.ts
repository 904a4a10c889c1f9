/** The actions of keys, in one table that the help shows too. */

export type Action =
  | "play"
  | "play-back"
  | "next"
  | "back"
  | "next-ten"
  | "back-ten"
  | "slower"
  | "faster"
  | "next-event"
  | "previous-event"
  | "filter"
  | "fit"
  | "center"
  | "trails"
  | "left"
  | "right"
  | "up"
  | "down"
  | "nearer"
  | "farther"
  | "deselect"
  | "edit"
  | "help"
  | "session";

interface Key {
  action: Action;
  /** Keys as `KeyboardEvent.key` tells them. */
  keys: readonly string[];
  shift?: boolean;
  shown: readonly string[];
  words: string;
}

export const KEYS: readonly Key[] = [
  { action: "play", keys: [" "], shown: ["Space"], words: "play or pause" },
  { action: "play-back", keys: ["b"], shown: ["b"], words: "play backwards or pause" },
  { action: "next-ten", keys: ["ArrowRight"], shift: true, shown: ["Shift →"], words: "ten cycles on" },
  { action: "back-ten", keys: ["ArrowLeft"], shift: true, shown: ["Shift ←"], words: "ten cycles back" },
  { action: "next", keys: ["ArrowRight"], shown: ["→"], words: "one cycle on" },
  { action: "back", keys: ["ArrowLeft"], shown: ["←"], words: "one cycle back" },
  { action: "slower", keys: ["["], shown: ["["], words: "slower" },
  { action: "faster", keys: ["]"], shown: ["]"], words: "faster" },
  { action: "next-event", keys: ["j"], shown: ["j"], words: "next event of the shown kinds" },
  { action: "previous-event", keys: ["k"], shown: ["k"], words: "previous event" },
  { action: "filter", keys: ["/"], shown: ["/"], words: "filter agents" },
  { action: "fit", keys: ["f"], shown: ["f"], words: "fit everything into the view" },
  { action: "center", keys: ["c"], shown: ["c"], words: "center the selected" },
  { action: "trails", keys: ["t"], shown: ["t"], words: "trails: of the selected, of all, none" },
  { action: "left", keys: ["a"], shown: ["a"], words: "move or turn the view left" },
  { action: "right", keys: ["d"], shown: ["d"], words: "right" },
  { action: "up", keys: ["w"], shown: ["w"], words: "up" },
  { action: "down", keys: ["s"], shown: ["s"], words: "down" },
  { action: "nearer", keys: ["+", "="], shown: ["+"], words: "nearer" },
  { action: "farther", keys: ["-"], shown: ["−"], words: "farther" },
  { action: "session", keys: ["1", "2", "3", "4"], shown: ["1", "…", "4"], words: "go to a session" },
  { action: "edit", keys: ["e"], shown: ["e"], words: "draw on the picture, or watch it" },
  { action: "deselect", keys: ["Escape"], shown: ["Esc"], words: "deselect" },
  { action: "help", keys: ["?"], shown: ["?"], words: "this help" },
];

/** Returns the action of a pressed key, if it has one. */
export function actionOf(
  event: Pick<KeyboardEvent, "key" | "shiftKey" | "ctrlKey" | "metaKey" | "altKey">,
): Action | null {
  if (event.ctrlKey || event.metaKey || event.altKey) return null;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const isArrow = key.startsWith("Arrow");
  const found = KEYS.find((k) => k.keys.includes(key) && (!isArrow || (k.shift ?? false) === event.shiftKey));
  return found?.action ?? null;
}

/** Elements that need their keys for themselves. */
const OWN_KEYS: Record<string, RegExp> = {
  INPUT: /./,
  TEXTAREA: /./,
  SELECT: /./,
  BUTTON: /^( |Enter)$/,
};

/** Returns whether the focused element takes this key itself. */
export function isTaken(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.isContentEditable || target.closest("dialog, .cm-editor, [data-editor]")) return true;
  if (target instanceof HTMLInputElement && target.type === "range") return /^(Arrow|Home|End|Page)/.test(key);
  if (target instanceof HTMLInputElement && target.type === "checkbox") return key === " ";
  if (target.getAttribute("role") === "tab" || target.getAttribute("role") === "listbox") {
    if (/^(Arrow|Home|End| |Enter)/.test(key)) return true;
  }
  return OWN_KEYS[target.tagName]?.test(key) ?? false;
}
