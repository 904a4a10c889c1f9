import { svelte } from "@sveltejs/vite-plugin-svelte";
import { defineConfig } from "vite";
import { slimThree } from "./slim-three.ts";

/** A server of `sidestep studio` that answers the page while it is developed. */
const server = process.env.STUDIO_SERVER ?? "http://127.0.0.1:7800";
const proxy = {
  "/socket": { target: server, ws: true, changeOrigin: true, rewriteWsOrigin: true },
  "/enter": { target: server, changeOrigin: true },
  "/report": { target: server, changeOrigin: true },
  "/export": { target: server, changeOrigin: true },
};

export default defineConfig({
  server: { proxy },
  preview: { proxy },
  plugins: [svelte(), slimThree()],
  build: {
    outDir: process.env.UI_OUT ?? "dist",
    emptyOutDir: true,
    target: "es2022",
    // The policy of the server's answers allows no inline data in scripts or styles.
    assetsInlineLimit: 0,
    // three alone passes the usual limit; the sum is held to account by a test.
    chunkSizeWarningLimit: 800,
    modulePreload: { polyfill: false },
  },
});
