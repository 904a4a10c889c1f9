/** Key bindings, in one table that the help shows too. */

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
  | "follow"
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
  /** Keys as in `KeyboardEvent.key`. */
  keys: readonly string[];
  shift?: boolean;
  labels: readonly string[];
  words: string;
}

export const KEYS: readonly Key[] = [
  { action: "play", keys: [" "], labels: ["Space"], words: "play or pause" },
  { action: "play-back", keys: ["b"], labels: ["b"], words: "play backwards or pause" },
  { action: "next-ten", keys: ["ArrowRight"], shift: true, labels: ["Shift →"], words: "ten cycles forward" },
  { action: "back-ten", keys: ["ArrowLeft"], shift: true, labels: ["Shift ←"], words: "ten cycles back" },
  { action: "next", keys: ["ArrowRight"], labels: ["→"], words: "one cycle forward" },
  { action: "back", keys: ["ArrowLeft"], labels: ["←"], words: "one cycle back" },
  { action: "slower", keys: ["["], labels: ["["], words: "slower" },
  { action: "faster", keys: ["]"], labels: ["]"], words: "faster" },
  { action: "next-event", keys: ["j"], labels: ["j"], words: "next visible event" },
  { action: "previous-event", keys: ["k"], labels: ["k"], words: "previous event" },
  { action: "filter", keys: ["/"], labels: ["/"], words: "filter agents" },
  { action: "fit", keys: ["f"], labels: ["f"], words: "fit everything into the view" },
  { action: "center", keys: ["c"], labels: ["c"], words: "center the selection" },
  { action: "trails", keys: ["t"], labels: ["t"], words: "trails: of the selection, of all, none" },
  { action: "follow", keys: ["v"], labels: ["v"], words: "the view follows the selection, or stays" },
  { action: "left", keys: ["a"], labels: ["a"], words: "move or turn the view left" },
  { action: "right", keys: ["d"], labels: ["d"], words: "right" },
  { action: "up", keys: ["w"], labels: ["w"], words: "up" },
  { action: "down", keys: ["s"], labels: ["s"], words: "down" },
  { action: "nearer", keys: ["+", "="], labels: ["+"], words: "nearer" },
  { action: "farther", keys: ["-"], labels: ["−"], words: "farther" },
  { action: "session", keys: ["1", "2", "3", "4"], labels: ["1", "…", "4"], words: "go to a session" },
  { action: "edit", keys: ["e"], labels: ["e"], words: "switch between drawing and watching" },
  { action: "deselect", keys: ["Escape"], labels: ["Esc"], words: "deselect" },
  { action: "help", keys: ["?"], labels: ["?"], words: "this help" },
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

/** Keys that focused elements handle themselves. */
const OWN_KEYS: Record<string, RegExp> = {
  INPUT: /./,
  TEXTAREA: /./,
  SELECT: /./,
  BUTTON: /^( |Enter)$/,
};

/** Returns whether the focused element handles this key itself. */
export function isHandledByTarget(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.isContentEditable || target.closest("dialog, .cm-editor, [data-editor]")) return true;
  if (target instanceof HTMLInputElement && target.type === "range") return /^(Arrow|Home|End|Page)/.test(key);
  if (target instanceof HTMLInputElement && target.type === "checkbox") return key === " ";
  if (target.getAttribute("role") === "tab" || target.getAttribute("role") === "listbox") {
    if (/^(Arrow|Home|End| |Enter)/.test(key)) return true;
  }
  return OWN_KEYS[target.tagName]?.test(key) ?? false;
}
