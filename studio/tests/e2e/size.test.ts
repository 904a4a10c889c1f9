/** The built page is small, both for the first load and for editing, and loads nothing from elsewhere. */

import { readdirSync, readFileSync } from "node:fs";
import { basename, join } from "node:path";
import { gzipSync } from "node:zlib";
import { expect, test } from "vitest";

/** Maximum size of all files of the first load. */
const MAX_FIRST_BYTES = 300_000;
/** Maximum size of the files that the editor adds, including the text view. */
const MAX_LATER_BYTES = 220_000;

const html = readFileSync("dist/index.html", "utf8");
const files = new Map(
  readdirSync("dist", { recursive: true, withFileTypes: true })
    .filter((entry) => entry.isFile())
    .map((entry) => [entry.name, readFileSync(join(entry.parentPath, entry.name))]),
);

/** The files of the first load: those that the page refers to, and their static imports. */
function first(): Set<string> {
  const found = new Set(["index.html"]);
  const open = [...html.matchAll(/(?:src|href)="\/([^"]+)"/g)].map(([, path]) => basename(path!));
  while (open.length > 0) {
    const name = open.pop()!;
    if (found.has(name) || !files.has(name)) continue;
    found.add(name);
    if (!name.endsWith(".js")) continue;
    const code = files.get(name)!.toString();
    for (const [, path] of code.matchAll(
      /(?:^|[;}\s])(?:import|export)\s*(?:[\w*{}$,\s]+?from)?\s*["']\.\/([^"']+)["']/g,
    ))
      open.push(basename(path!));
  }
  return found;
}

const weight = (names: Iterable<string>): number =>
  [...names].reduce((bytes, name) => bytes + gzipSync(files.get(name)!, { level: 9 }).length, 0);

test("the first load is at most 300 kB, compressed, and the rest is loaded on demand", () => {
  const needed = first();
  const [now, all] = [weight(needed), weight(files.keys())];
  console.log(`${Math.round(now / 1000)} kB first, ${Math.round((all - now) / 1000)} kB later`);
  expect(now).toBeGreaterThan(50_000);
  expect(now).toBeLessThanOrEqual(MAX_FIRST_BYTES);
  expect(all - now).toBeLessThanOrEqual(MAX_LATER_BYTES);
  expect([...needed].some((name) => /editor|Bar|Forms|Layer/.test(name))).toBe(false);
});

test("the page needs no inline script or style", () => {
  expect(html).not.toMatch(/<style|style=|<script>|onload=/);
});
