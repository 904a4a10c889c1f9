import { svelte } from "@sveltejs/vite-plugin-svelte";
import { defineConfig } from "vitest/config";

/** `npm test` runs the unit tests; MODE_OF_TESTS=e2e or bench runs those in a real browser. */
const mode = process.env.MODE_OF_TESTS ?? "unit";

export default defineConfig({
  plugins: [svelte()],
  test: {
    include: [`tests/${mode}/**/*.test.ts`],
    testTimeout: mode === "unit" ? 20_000 : 180_000,
    hookTimeout: 180_000,
    fileParallelism: mode === "unit",
  },
});
