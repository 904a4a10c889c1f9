/** Numbers and names as text for people. */

import type { Point3, FactValue, BodyId } from "./protocol";

/** Narrow space between a number and its unit. */
const NARROW = "\u202f";

/** Singular of units that are words. */
const SINGULAR: Record<string, string> = {
  cycles: "cycle",
  boxes: "box",
  bodies: "body",
  bytes: "byte",
  messages: "message",
  connectors: "connector",
};

/** A number with at most four significant digits, and its unit. */
export function withUnit(value: number, unit = ""): string {
  return unit === "" ? number(value) : `${number(value)}${NARROW}${value === 1 ? (SINGULAR[unit] ?? unit) : unit}`;
}

/** A number with at most four significant digits; whole numbers keep all of theirs, in groups of three. */
export function number(value: number): string {
  if (Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  const size = Math.abs(value);
  if (Number.isInteger(value) && size < 1e15) return sign(group(value.toFixed(0)));
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) return sign(scientific(value));
  return sign(group(size >= 1000 ? value.toFixed(0) : trim(value.toPrecision(4))));
}

function trim(text: string): string {
  return text.includes(".") ? text.replace(/\.?0+$/, "") : text;
}

function group(text: string): string {
  const [whole = "", rest] = text.split(".");
  const groups = whole.replace(/(?<=\d)(?=(\d{3})+$)/g, "\u202f");
  const long = whole.replace("-", "").length > 4 ? groups : whole;
  return rest === undefined ? long : `${long}.${rest}`;
}

function scientific(value: number): string {
  const [mantissa = "", exponent = ""] = value.toExponential(2).split("e");
  return `${trim(mantissa)}e${exponent.replace("+", "")}`;
}

/** A number for the short labels of an axis. */
export function short(value: number): string {
  const size = Math.abs(value);
  if (size >= 1e9) return number(value);
  if (size >= 1e6) return `${number(value / 1e6)}${NARROW}M`;
  return size >= 1e5 ? `${number(value / 1e3)}${NARROW}k` : number(value);
}

/** A true minus sign. */
function sign(text: string): string {
  return text.replace("-", "−").replace("e-", "e−");
}

/** A proportion in percent. */
export function share(value: number): string {
  const percent = 100 * value;
  const digits = percent !== 0 && Math.abs(percent) < 10 ? 1 : 0;
  return `${sign(trim(percent.toFixed(digits)))}${NARROW}%`;
}

/** An amount of data, in powers of 1024. */
export function bytes(amount: number): string {
  const units = ["B", "KiB", "MiB", "GiB", "TiB"];
  let size = amount;
  let unit = 0;
  while (size >= 1024 && unit < units.length - 1) {
    size /= 1024;
    unit++;
  }
  const digits = size < 10 && unit > 0 ? 1 : 0;
  return `${trim(size.toFixed(digits))}${NARROW}${units[unit]}`;
}

/** Simulated time: seconds below two minutes, then minutes and hours. */
export function time(time_s: number): string {
  if (time_s < 120) return withUnit(Math.round(time_s * 100) / 100, "s");
  const two = (n: number): string => String(Math.floor(n)).padStart(2, "0");
  const clock = `${two((time_s / 60) % 60)}:${two(time_s % 60)}`;
  return time_s < 3600 ? `${clock}${NARROW}min` : `${Math.floor(time_s / 3600)}:${clock}${NARROW}h`;
}

/** A position, with as many coordinates as the world has dimensions. */
export function place(at_m: Point3, dimensions: number): string {
  return `(${at_m.slice(0, dimensions).map(number).join(", ")})${NARROW}m`;
}

/** The label of a body without a name of its own. */
export function bodyLabel(who: BodyId): string {
  return who.part === null ? `${who.kind} ${who.number}` : `${who.kind} ${who.number}/${who.part}`;
}

/** A unique key of a body. */
export function bodyKey(who: BodyId): string {
  return `${who.kind}/${who.number}/${who.part ?? ""}`;
}

/** A value of an inspection, except bodies, which become links. */
export function valueText(value: FactValue, dimensions: number): string {
  if (value === "none") return "–";
  if ("number" in value) return withUnit(value.number.value, value.number.unit);
  if ("share" in value) return share(value.share);
  if ("text" in value) return value.text;
  if ("body" in value) return bodyLabel(value.body);
  if ("place" in value) return place(value.place, dimensions);
  return value.flag ? "yes" : "no";
}

/** Minimum cycles per second at the start: a slower run looks stopped. */
const MIN_CYCLES_PER_S = 8;

/** The initial speed of a run with cycles of this length. */
export function initialSpeed(cycle_s: number): number {
  return [1, 2, 5, 10, 20, 50].find((times) => times >= MIN_CYCLES_PER_S * cycle_s) ?? 100;
}

/** The speeds that keys switch between, in simulated seconds per second. */
export const SPEEDS: readonly (number | "fastest")[] = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, "fastest"];
