/** Files that are dropped on the page: what the browser hands over, the copies of the server, and what becomes of them. */

import { makeProblem, RequestError } from "../connection";
import type { FileEntry, Problem } from "../protocol";
import { parseFailure } from "./results";

/** Maximum number of files of a drop: a run has some dozens. */
export const MAX_FILES = 5000;

/** A dropped file and its path within the drop. */
export interface DropFile {
  path: string;
  file: File;
}

/** A file or a folder at the top of a drop. */
export interface DropItem {
  name: string;
  files: DropFile[];
}

/** The parts of `FileSystemEntry` that are used. */
interface Entry {
  readonly isDirectory: boolean;
  readonly name: string;
}
interface FileOfEntry extends Entry {
  file(then: (file: File) => void, fail: (error: unknown) => void): void;
}
interface FolderOfEntry extends Entry {
  createReader(): { readEntries(then: (entries: Entry[]) => void, fail: (error: unknown) => void): void };
}

const tooMany = (name: string): RequestError =>
  new RequestError(
    makeProblem(
      name,
      `has more than ${MAX_FILES} files`,
      "start the studio with the folder instead: `sidestep studio FOLDER`",
    ),
  );

const unreadable = (name: string): RequestError =>
  new RequestError(
    makeProblem(
      name,
      "could not be read",
      "check that it still exists and that you may read it; or start the studio with its folder: `sidestep studio FOLDER`",
    ),
  );

/** What a browser hands to callbacks; its error, which tells little, becomes one with the name of the file. */
async function callbackOf<T>(
  name: string,
  start: (then: (value: T) => void, fail: (error: unknown) => void) => void,
): Promise<T> {
  try {
    return await new Promise<T>(start);
  } catch {
    throw unreadable(name);
  }
}

async function entriesOf(folder: FolderOfEntry): Promise<Entry[]> {
  const reader = folder.createReader();
  const all: Entry[] = [];
  while (true) {
    // A reader returns some at a time, and none at the end.
    const some = await callbackOf<Entry[]>(folder.name, (then, fail) => reader.readEntries(then, fail));
    if (some.length === 0) return all;
    all.push(...some);
    if (all.length > MAX_FILES) throw tooMany(folder.name);
  }
}

async function collect(entry: Entry, above: string, files: DropFile[]): Promise<void> {
  const path = above + entry.name;
  if (files.length >= MAX_FILES) throw tooMany(path);
  if (!entry.isDirectory) {
    const file = await callbackOf<File>(path, (then, fail) => (entry as FileOfEntry).file(then, fail));
    files.push({ path, file });
    return;
  }
  for (const inner of await entriesOf(entry as FolderOfEntry)) {
    // Hidden files are no part of runs.
    if (!inner.name.startsWith(".")) await collect(inner, `${path}/`, files);
  }
}

/** Reads what was dropped; the transfer itself is only valid during the event, its entries are longer. */
export function itemsOf(transfer: DataTransfer): Promise<DropItem[]> {
  // A transfer may hold texts too, which have no file.
  const items = [...transfer.items].filter(({ kind }) => kind === "file");
  const entries = items.map((item) => item.webkitGetAsEntry?.() ?? null);
  const plain = [...transfer.files];
  return Promise.all(
    plain.map(async (file, i) => {
      const entry = entries[i] as Entry | null | undefined;
      const files: DropFile[] = [];
      if (entry) await collect(entry, "", files);
      else files.push({ path: file.name, file });
      return { name: entry?.name ?? file.name, files };
    }),
  );
}

/** Copies files to the server. Returns the server's path of the item. */
export async function upload(item: DropItem, drop: string, onProgress: (done: number) => void): Promise<string> {
  let path = "";
  let done = 0;
  for (const { path: below, file } of item.files) {
    const answer = await post(`${drop}/${below}`, file);
    onProgress(++done);
    // The path of a file in a folder begins with that of the folder.
    path = answer.slice(0, answer.length - below.length) + item.name;
  }
  if (path === "") throw new RequestError(makeProblem(item.name, "is an empty folder", "drop the folder of a run"));
  return path;
}

async function post(path: string, file: File): Promise<string> {
  let answer: Response;
  let text: string;
  try {
    answer = await fetch(`/drop?path=${encodeURIComponent(path)}`, { method: "POST", body: file });
    text = await answer.text();
  } catch {
    const remedy = "drop it again once the page is connected; check that the file can be read";
    throw new RequestError(makeProblem(file.name, "could not be handed over to the server", remedy));
  }
  if (!answer.ok) throw new RequestError(parseFailure(file.name, text));
  return text;
}

/** What is done with a file, or why nothing is. */
export type FileAction =
  { do: "open"; kind: "scenario" | "recording" } | { do: "sweep" } | { do: "map" } | { do: "refuse"; problem: Problem };

/** What a person expects who opens a file of this kind. */
export function actionOf({ kind, name, path }: FileEntry): FileAction {
  const refuse = (cause: string, remedy: string): FileAction => ({
    do: "refuse",
    problem: makeProblem(name, cause, remedy),
  });
  switch (kind) {
    case "scenario":
    case "foreign":
      return { do: "open", kind: "scenario" };
    case "run":
    case "recording":
      return { do: "open", kind: "recording" };
    case "map":
      return { do: "map" };
    case "sweep":
      if (!path.toLowerCase().endsWith(".toml")) return { do: "sweep" };
      return refuse(
        "is the plan of a sweep, which the command runs",
        `${sweepCommand(path)}; then open its folder here`,
      );
    case "profile":
      return refuse(
        "has sensors and effectors that were learned from logs, for robots of a scenario",
        'open a scenario, then Edit and Import…, or name it there: profiles = ["FILE.toml"]',
      );
    case "model":
      return refuse(
        "has the links and joints of a robot, for chains of a scenario",
        'name it in a scenario: arm = { urdf = "FILE.urdf" }, as chain/arm.toml does',
      );
    case "folder":
      return refuse("is a folder, and neither a run nor a sweep", "choose one with run.json or sweep.json");
  }
}

/** The command that runs a sweep. */
export function sweepCommand(path: string): string {
  const stem = (path.split("/").at(-1) ?? path).replace(/(\.sweep)?\.toml$/i, "");
  const quoted = (text: string): string => (/^[\w./+-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);
  return `sidestep sweep ${quoted(path)} --out ${quoted(`sweeps/${stem}`)}`;
}
