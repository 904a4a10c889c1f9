/**
 * Builds three from its sources without what only its own materials need: the page has shaders of its own, and a third
 * of three is text of shaders for light, fog, shadows and environments. Saves about 40 kB of the page's 300.
 */

import type { Plugin } from "vite";

/** Modules of three that nothing of the page reaches, and what their importers still want to find there. */
const STUBS: Record<string, string> = {
  "renderers/shaders/ShaderLib.js": "export const ShaderLib = {};",
  "renderers/shaders/ShaderChunk.js": "export const ShaderChunk = {};",
  "renderers/shaders/DFGLUTData.js": "export function getDFGLUT() { throw new Error('left out of this build'); }",
  "extras/PMREMGenerator.js":
    "export class PMREMGenerator { constructor() { throw new Error('left out of this build'); } }",
};

export function slimThree(): Plugin {
  return {
    name: "slim-three",
    enforce: "pre",
    apply: "build",
    config: () => ({ resolve: { alias: [{ find: /^three$/, replacement: "three/src/Three.js" }] } }),
    load(id) {
      const path = id.replaceAll("\\", "/").split("/three/src/")[1];
      return path === undefined ? null : (STUBS[path] ?? null);
    },
  };
}
