/**
 * How scenarios of a world are edited on the canvas. The page has the tools; each world declares those that it needs, with
 * the sections of its text: see `crates/scenario/src/editing.rs`, which these types mirror.
 */

import type { FileKind, Scene } from "../protocol";
import { isTable, partsOf, valueAt, type Json, type TomlTable } from "./keypath";

/** The boxes that a tool draws. */
export type PaintArea = "brush" | "line" | "rectangle" | "fill" | "eraser";

/** The effect of a tool. */
export type EditAction =
  | { do: "select" }
  | { do: "paint"; area: PaintArea }
  | { do: "add-body" | "add-door"; section: string; template: TomlTable }
  | {
      do:
        | "add-goal"
        | "add-point"
        | "add-ball"
        | "add-wall"
        | "add-box"
        | "add-polygon"
        | "add-patrol"
        | "add-route"
        | "add-way-point";
      section: string;
    };

export interface Tool {
  /** Unique among the tools of a world. */
  id: string;
  /** Its symbol on narrow screens. */
  sign: string;
  name: string;
  help: string;
  action: EditAction;
}

/** Items of a text that have positions. */
export type ItemSource =
  | { of: "goals" | "obstacles"; section: string }
  | { of: "points" | "starts" | "routes"; section: string; noun: string }
  | { of: "bodies"; section: string; noun: string; turns: boolean };

/** A restriction of scenarios that have one key and lack another. */
interface EditNote {
  when: string | null;
  unless: string | null;
  text: string;
}

/** The use of a file that holds no scenario. */
export interface FileUse {
  kind: FileKind;
  /** Endings of its name; none for any. */
  endings: string[];
  key: string;
  is_list: boolean;
  /** Keys that it replaces. */
  replaces: string[];
  /** What such a file is. */
  about: string;
  /** Numbers that the file does not say. */
  asks: AskedNumber[];
}

/** A number above 0 that is asked for with a file. */
export interface AskedNumber {
  key: string;
  name: string;
  unit: string;
}

/** A new scenario with an empty floor of a chosen size within walls. */
export interface NewDrawing {
  /** Its noun for people. */
  name: string;
  /** What is on the floor. */
  about: string;
  /** Its text, with places for what is chosen: see `crates/scenario/src/editing.rs`. */
  text: string;
  /** The tool with which drawing begins. */
  tool: string;
  /** The text of a new scenario on the map of a file, without the map. */
  text_on_map: string;
}

export interface Editing {
  tools: Tool[];
  tools_in_space: Tool[];
  items: ItemSource[];
  notes: EditNote[];
  files: FileUse[];
  about_files: string;
  drawing: NewDrawing | null;
}

/** The editing of a world that declares none, or none yet. */
export const NO_EDITING: Editing = {
  tools: [],
  tools_in_space: [],
  items: [],
  notes: [],
  files: [],
  about_files: "",
  drawing: null,
};

/** The editing in a reply of the server. */
export function editingOf(answer: unknown): Editing {
  return isTable(answer) ? { ...NO_EDITING, ...(answer as unknown as Partial<Editing>) } : NO_EDITING;
}

/** The tools for a scene; none if nothing of it can be edited on the canvas. */
export function toolsOf(editing: Editing, scene: Scene): readonly Tool[] {
  return scene.dimensions === 2 ? editing.tools : editing.tools_in_space;
}

/** Returns the reason why a scene, or a part of it, cannot be edited on the canvas; empty if all can. */
export function restrictionOn(editing: Editing, scene: Scene, model: TomlTable): string {
  if (scene.is_recording) return "A recording cannot be changed: open its scenario instead.";
  const hasTools = toolsOf(editing, scene).length > 0;
  if (!hasTools && scene.dimensions === 3)
    return "A scene in space is edited in its forms and its text: a point on the screen has no unique position in space.";
  if (!hasTools) return "This world is edited in its forms and its text.";
  const has = (key: string): boolean => valueOf(model, key) !== undefined;
  const note = editing.notes.find(
    ({ when, unless }) => (when === null || has(when)) && (unless === null || !has(unless)),
  );
  return note?.text ?? "";
}

/** The value of a key such as `map.ascii`. */
export function valueOf(model: TomlTable, key: string): Json | undefined {
  return valueAt(model, partsOf(key));
}
