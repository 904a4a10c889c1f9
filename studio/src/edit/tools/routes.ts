/** Routes: starts with headings, and way-points. */

import type { Edit, Point3 } from "../../protocol";
import { numbersOf, sectionsOf, type Json, type Path, type TomlTable } from "../keypath";
import { insert, remove, removeFrom, roundTo, set, type Item } from "./item";

function pointOf(value: Json | undefined): Point3 | null {
  const numbers = numbersOf(value, 2);
  return numbers ? [numbers[0]!, numbers[1]!, 0] : null;
}

/** The way-points of a route, with their numbers in the text. */
function routeOf(value: TomlTable): { at: Point3; index: number }[] {
  const given = Array.isArray(value["way_points_m"]) ? value["way_points_m"] : [];
  return given.flatMap((one, index) => {
    const at = pointOf(one);
    return at ? [{ at, index }] : [];
  });
}

/** Headings are degrees from east, counterclockwise. */
export function headingTo([x0, y0]: Point3, [x1, y1]: Point3): number {
  return Math.round((Math.atan2(y1 - y0, x1 - x0) * 180) / Math.PI);
}

/** All routes of a kind of sections. */
export function routeItems(model: TomlTable, section: string, noun: string, m_per_px: number): Item[] {
  return sectionsOf(model, section).flatMap(({ path, value }, i) => {
    const start = pointOf(value["at_m"]);
    if (!start) return [];
    const words = typeof value["callsign"] === "string" ? value["callsign"] : `${noun} ${i + 1}`;
    const round = ([x, y]: Point3): number[] => [roundTo(x, m_per_px), roundTo(y, m_per_px)];
    const route = routeOf(value);
    const own: Item = {
      path,
      words: `${words}, its start`,
      kind: "start",
      outline_m: [start, ...route.map(({ at }) => at)],
      isClosed: false,
      at_m: start,
      move: (to) => [set([...path, "at_m"], round(to))],
      remove: () => [remove(path)],
      turn: () => [
        set(
          [...path, "heading_deg"],
          ((typeof value["heading_deg"] === "number" ? value["heading_deg"] : 0) + 90) % 360,
        ),
      ],
    };
    const points = route.map(({ at, index }): Item => ({
      path: [...path, "way_points_m", index],
      words: `way-point ${index + 1} of ${words}`,
      kind: "goal",
      outline_m: [at],
      isClosed: false,
      at_m: at,
      move: (to) => [set([...path, "way_points_m", index], round(to))],
      remove: () => removeFrom(path, "way_points_m", index, value),
    }));
    return [own, ...points];
  });
}

/** Adds a route from one position to another. */
export function putRoute(section: string, from: Point3, to: Point3, m_per_px: number): Edit[] {
  const round = ([x, y]: Point3): number[] => [roundTo(x, m_per_px), roundTo(y, m_per_px)];
  return [insert([section], { at_m: round(from), heading_deg: headingTo(from, to), way_points_m: [round(to)] })];
}

/** The text that a tool edits, and what is selected in it. */
export interface RouteEdit {
  model: TomlTable;
  /** The sections of the routes. */
  section: string;
  chosen: Path | null;
  m_per_px: number;
}

/** Adds a way-point to the selected route, else to the last one. */
export function putWayPoint({ model, section, chosen, m_per_px }: RouteEdit, at: Point3): Edit[] {
  const all = sectionsOf(model, section).filter(({ value }) => value["at_m"] !== undefined);
  const host = all.find(({ path }) => chosen && path.every((part, i) => part === chosen[i])) ?? all.at(-1);
  if (!host) return [];
  const place = [roundTo(at[0], m_per_px), roundTo(at[1], m_per_px)];
  const path = [...host.path, "way_points_m"];
  return [Array.isArray(host.value["way_points_m"]) ? insert(path, place) : set(path, [place])];
}
