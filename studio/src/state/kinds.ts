/** Colors of kinds of events: Okabe and Ito's, chosen by name, so that a kind has the same color in every session. */

const LIGHT = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
const DARK = ["#56b4e9", "#f0803c", "#2fc79b", "#e39cc4", "#f0b849", "#8fd0f7"];
/** The level is used where a world gives no kind. */
const LEVEL_COLORS: Record<string, readonly [string, string]> = {
  info: ["#0072b2", "#56b4e9"],
  warning: ["#d55e00", "#f0803c"],
  error: ["#d01010", "#ff6b60"],
};
/** Kinds that should not occur have the alarm color. */
const ALARMS = /contact|collision|loss|separation|fail|veto|violat/;

/** Returns whether a kind should not occur. */
export function isAlarm(kind: string): boolean {
  return ALARMS.test(kind) || kind === "error";
}

export function eventColor(kind: string, isDark: boolean): string {
  const level = LEVEL_COLORS[kind];
  if (level) return level[isDark ? 1 : 0];
  if (ALARMS.test(kind)) return isDark ? "#ff6b60" : "#d01010";
  let sum = 0;
  for (const letter of kind) sum = (31 * sum + letter.charCodeAt(0)) % 65_521;
  const colors = isDark ? DARK : LIGHT;
  return colors[sum % colors.length]!;
}
