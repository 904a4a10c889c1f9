/** The whole page, as it was built, is small and keeps to itself. */

import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";
import { expect, test } from "vitest";

const MOST_BYTES = 300_000;
const files = readdirSync("dist", { recursive: true, withFileTypes: true })
  .filter((entry) => entry.isFile())
  .map((entry) => readFileSync(join(entry.parentPath, entry.name)));

test("the page is at most 300 kB, compressed", () => {
  const sum = files.reduce((bytes, file) => bytes + gzipSync(file, { level: 9 }).length, 0);
  console.log(`${Math.round(sum / 1000)} kB`);
  expect(sum).toBeLessThanOrEqual(MOST_BYTES);
});

test("the page needs no inline script or style", () => {
  const html = readFileSync("dist/index.html", "utf8");
  expect(html).not.toMatch(/<style|style=|<script>|onload=/);
});
