/** Points with a position in meters, and nothing else that the canvas shows. */

import type { Edit, Point3 } from "../../protocol";
import { numbersOf, sectionsOf, type TomlTable } from "../keypath";
import { insert, remove, roundTo, set, type Item } from "./item";

/** All points of a kind of sections. */
export function pointItems(model: TomlTable, section: string, noun: string, m_per_px: number): Item[] {
  return sectionsOf(model, section).flatMap(({ path, value }, i): Item[] => {
    const at = numbersOf(value["at_m"], 2);
    if (!at) return [];
    const at_m: Point3 = [at[0]!, at[1]!, 0];
    return [
      {
        path,
        words: `${noun} ${i + 1}`,
        kind: "point",
        outline_m: [at_m],
        isClosed: false,
        at_m,
        move: (to) => [set([...path, "at_m"], [roundTo(to[0], m_per_px), roundTo(to[1], m_per_px)])],
        remove: () => [remove(path)],
      },
    ];
  });
}

/** Adds a point. */
export function putPoint(section: string, at: Point3, m_per_px: number): Edit[] {
  return [insert([section], { at_m: [roundTo(at[0], m_per_px), roundTo(at[1], m_per_px)] })];
}
