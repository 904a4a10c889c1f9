/** The tools of each world. */

import type { Scene } from "../../protocol";
import type { AsciiMap } from "../ascii-map";

export type ToolId =
  | "select"
  | "brush"
  | "line"
  | "rectangle"
  | "fill"
  | "eraser"
  | "robot"
  | "person"
  | "door"
  | "goal"
  | "ball"
  | "wall"
  | "box"
  | "polygon"
  | "patrol"
  | "airplane"
  | "way-point";

export interface Tool {
  id: ToolId;
  /** Its symbol on narrow screens. */
  sign: string;
  name: string;
  help: string;
  /** Whether it draws boxes of a map. */
  paints: boolean;
}

function tool(id: ToolId, sign: string, name: string, help: string, paints = false): Tool {
  return { id, sign, name, help, paints };
}

const SELECT = tool("select", "↖", "Select", "Click selects, drag moves, Delete removes, r rotates");
const ROBOTS: readonly Tool[] = [
  SELECT,
  tool("brush", "✎", "Brush", "Drag draws boxes", true),
  tool("line", "╱", "Line", "Drag from start to end", true),
  tool("rectangle", "▭", "Rectangle", "Drag from corner to corner; with Shift filled", true),
  tool("fill", "▨", "Fill", "Fills the connected area", true),
  tool("eraser", "⌫", "Eraser", "Drag clears boxes", true),
  tool("robot", "●", "Robot", "Click adds a robot to the selected group"),
  tool("person", "☺", "Person", "Click adds a person"),
  tool("door", "▯", "Door", "Drag over the boxes of a door; walls there are removed"),
  tool("goal", "⚑", "Way-point", "Click adds a way-point to the selected robots"),
];
const CHAIN: readonly Tool[] = [
  SELECT,
  tool("ball", "●", "Ball", "Drag from center to edge"),
  tool("wall", "╱", "Wall", "Drag from end to end"),
  tool("box", "▭", "Box", "Drag from corner to corner"),
  tool("polygon", "△", "Polygon", "Drag one side of a triangle; a click adds a corner to the selected polygon"),
  tool("patrol", "⇄", "Patrol", "Click adds a way-point to the selected ball or box, which then moves back and forth"),
];
/** Tools in space, where items can be moved but not added. */
const CHAIN_IN_SPACE: readonly Tool[] = [
  tool(
    "select",
    "↖",
    "Select",
    "Drag moves in the plane of the view, an arrow of the selected item along its axis; Delete removes",
  ),
];
const AIRSPACE: readonly Tool[] = [
  SELECT,
  tool("airplane", "✈", "Airplane", "Drag from its start to its first way-point"),
  tool("way-point", "⚑", "Way-point", "Click adds a way-point to the selected airplane"),
];

/** The tools for a scene; none if nothing of it can be edited on the canvas. */
export function toolsOf(scene: Scene): readonly Tool[] {
  if (scene.dimensions !== 2) return scene.world === "chain" ? CHAIN_IN_SPACE : [];
  if (scene.world === "robots") return ROBOTS;
  if (scene.world === "chain") return CHAIN;
  return scene.world === "airspace" ? AIRSPACE : [];
}

/** Returns the reason why a scene, or a part of it, cannot be edited on the canvas; empty if all can. */
export function restrictionOn(
  scene: Scene,
  map: AsciiMap | null,
  has: { file: boolean; office: boolean; airplanes: boolean },
): string {
  if (scene.is_recording) return "A recording cannot be changed: open its scenario instead.";
  if (toolsOf(scene).length === 0 && scene.dimensions === 3)
    return "A scene in space is edited in its forms and its text: a point on the screen has no unique position in space.";
  if (toolsOf(scene).length === 0) return "This world is edited in its forms and its text.";
  if (scene.world === "robots" && !map && has.office)
    return "The walls are those of a generated office: the text gives only its measures.";
  if (scene.world === "robots" && !map && has.file) return "The walls come from a file that the scenario refers to.";
  if (scene.world === "airspace" && !has.airplanes)
    return "Generated traffic has no airplanes in the text; those that you add fly in addition to it.";
  return "";
}
