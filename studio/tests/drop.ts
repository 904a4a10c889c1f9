/** Files and folders that are dropped on the page, as a browser hands them over. */

import type { Page } from "playwright-core";

type Content = string | Uint8Array;

/** Files by their names, and folders, which have files by their names. */
export type DropItems = Record<string, Content | Record<string, Content>>;

const isContent = (content: DropItems[string]): content is Content =>
  typeof content === "string" || content instanceof Uint8Array;

const base64 = (content: Content): string => Buffer.from(content).toString("base64");

/** The same with contents as text that a page can be handed. */
function encode(items: DropItems): Record<string, string | Record<string, string>> {
  const entries = Object.entries(items).map(([name, content]) => {
    if (isContent(content)) return [name, base64(content)] as const;
    const files = Object.entries(content).map(([inner, bytes]) => [inner, base64(bytes)] as const);
    return [name, Object.fromEntries(files)] as const;
  });
  return Object.fromEntries(entries);
}

/** Drops files and folders on the page. */
export async function drop(page: Page, items: DropItems): Promise<void> {
  await page.evaluate((dropped) => {
    interface Handed {
      isDirectory: boolean;
      name: string;
      file?: (then: (file: File) => void) => void;
      createReader?: () => { readEntries: (then: (entries: Handed[]) => void) => void };
    }
    const fileOf = (name: string, text: string): Handed => ({
      isDirectory: false,
      name,
      file: (then) => then(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name)),
    });
    const entries = Object.entries(dropped).map(([name, content]): Handed => {
      if (typeof content === "string") return fileOf(name, content);
      let rest = Object.entries(content).map(([inner, text]) => fileOf(inner, text));
      return {
        isDirectory: true,
        name,
        createReader: () => ({
          readEntries: (then) => {
            then(rest);
            rest = [];
          },
        }),
      };
    });
    const transfer = {
      types: ["Files"],
      items: entries.map((entry) => ({ kind: "file", webkitGetAsEntry: () => entry })),
      files: entries.map(({ name }) => new File([], name)),
      dropEffect: "none",
    };
    for (const type of ["dragenter", "dragover", "drop"]) {
      const event = new Event(type, { bubbles: true, cancelable: true });
      Object.defineProperty(event, "dataTransfer", { value: transfer });
      document.body.dispatchEvent(event);
    }
  }, encode(items));
}
