/** The tools of each world. */

import type { Scene } from "../../protocol";
import type { Board } from "../board";

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
  /** Its sign on narrow screens. */
  sign: string;
  name: string;
  help: string;
  /** Whether it draws boxes of a map. */
  paints: boolean;
}

function tool(id: ToolId, sign: string, name: string, help: string, paints = false): Tool {
  return { id, sign, name, help, paints };
}

const SELECT = tool("select", "↖", "Select", "Click selects, drag moves, Delete takes away, r turns");
const ROBOTS: readonly Tool[] = [
  SELECT,
  tool("brush", "✎", "Brush", "Drag draws boxes", true),
  tool("line", "╱", "Line", "From press to release", true),
  tool("rectangle", "▭", "Rectangle", "From corner to corner; with Shift all of it", true),
  tool("fill", "▨", "Fill", "Fills what hangs together", true),
  tool("eraser", "⌫", "Eraser", "Drag makes boxes free", true),
  tool("robot", "●", "Robot", "Click puts a robot beside those that are chosen"),
  tool("person", "☺", "Person", "Click puts a person"),
  tool("door", "▯", "Door", "Drag over the boxes of a door; walls there make way"),
  tool("goal", "⚑", "Way-point", "Click adds a way-point of the chosen robots"),
];
const CHAIN: readonly Tool[] = [
  SELECT,
  tool("ball", "●", "Ball", "Drag from its middle to its edge"),
  tool("wall", "╱", "Wall", "Drag from end to end"),
  tool("box", "▭", "Box", "Drag from corner to corner"),
  tool("polygon", "△", "Polygon", "Drag one side of a triangle; a click adds a corner to the polygon that is chosen"),
  tool("patrol", "⇄", "Patrol", "Click adds a way-point to the chosen ball or box, which then goes to and fro"),
];
/** Tools in space, where nothing can be placed anew: existing things are moved. */
const CHAIN_IN_SPACE: readonly Tool[] = [
  tool(
    "select",
    "↖",
    "Select",
    "Drag moves in the plane of the view, an arrow of the chosen thing along its axis; Delete takes away",
  ),
];
const AIRSPACE: readonly Tool[] = [
  SELECT,
  tool("airplane", "✈", "Airplane", "Drag from its start to its first way-point"),
  tool("way-point", "⚑", "Way-point", "Click adds a way-point of the chosen airplane"),
];

/** The tools that fit a scene; none where nothing of it can be drawn upon. */
export function toolsOf(scene: Scene): readonly Tool[] {
  if (scene.dimensions !== 2) return scene.world === "chain" ? CHAIN_IN_SPACE : [];
  if (scene.world === "robots") return ROBOTS;
  if (scene.world === "chain") return CHAIN;
  return scene.world === "airspace" ? AIRSPACE : [];
}

/** Returns the reason why a scene, or a part of it, cannot be drawn upon; nothing where all can. */
export function obstacleTo(
  scene: Scene,
  board: Board | null,
  has: { file: boolean; office: boolean; airplanes: boolean },
): string {
  if (scene.is_recording) return "A recording stays as it is: open its scenario to change it.";
  if (toolsOf(scene).length === 0 && scene.dimensions === 3)
    return "A scene in space is changed in its forms and its text: there is nothing here to draw on, as a place on the screen is no place in space.";
  if (toolsOf(scene).length === 0) return "This world is changed in its forms and its text.";
  if (scene.world === "robots" && !board && has.office)
    return "The walls are those of a generated office, which the text only measures.";
  if (scene.world === "robots" && !board && has.file) return "The walls are those of a file beside the scenario.";
  if (scene.world === "airspace" && !has.airplanes)
    return "Generated traffic has no airplanes of its own in the text; those that you put fly beside it.";
  return "";
}
