/** The real program, at the path SIDESTEP_BINARY, behind the built page. */

import { spawn, type ChildProcess } from "node:child_process";
import { createInterface } from "node:readline";
import { fileURLToPath } from "node:url";
import { preview, type PreviewServer } from "vite";

export const BINARY = process.env.SIDESTEP_BINARY ?? "";
/** The folder of the shipped scenarios. */
export const SCENARIOS = fileURLToPath(new URL("../../../scenarios", import.meta.url));

export class Program {
  readonly url: string;
  readonly #child: ChildProcess;
  readonly #page: PreviewServer;

  private constructor(url: string, child: ChildProcess, page: PreviewServer) {
    this.url = url;
    this.#child = child;
    this.#page = page;
  }

  /** Starts it with a folder; the page comes from `dist` and forwards its socket. */
  static async start(folder: string): Promise<Program> {
    const child = spawn(BINARY, ["studio", "--no-open", "--port", "0", "--quiet", folder], {
      stdio: ["ignore", "pipe", "inherit"],
    });
    const lines = createInterface({ input: child.stdout! });
    const server = await new Promise<string>((resolve, reject) => {
      lines.once("line", (line) => resolve(line.trim().replace(/\/$/, "")));
      child.once("exit", (code) => reject(new Error(`the program ended with ${code}`)));
    });
    const proxy = {
      "/socket": { target: server, ws: true, changeOrigin: true, rewriteWsOrigin: true },
      "/enter": { target: server, changeOrigin: true },
      "/picture": { target: server, changeOrigin: true },
      "/drop": { target: server, changeOrigin: true, headers: { origin: server } },
      "/usage": { target: server, changeOrigin: true },
      "/report": { target: server, changeOrigin: true },
    };
    const page = await preview({
      configFile: false,
      logLevel: "silent",
      build: { outDir: "dist" },
      preview: { port: 0, host: "127.0.0.1", proxy },
    });
    const address = page.httpServer.address();
    if (typeof address !== "object" || address === null) throw new Error("the page is not served");
    return new Program(`http://127.0.0.1:${address.port}/`, child, page);
  }

  async stop(): Promise<void> {
    this.#child.removeAllListeners("exit");
    this.#child.kill();
    await this.#page.close();
  }
}
