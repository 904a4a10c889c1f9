/** The page's own sessions before the real program, without a browser: what is not about pictures is tested so. */

import { vi } from "vitest";
import { WebSocket } from "ws";
import type { Socket } from "../../src/connection";
import { Studio } from "../../src/state/studio.svelte";
import type { Program } from "./program";

/** Time between two grants of frames, which are not drawn here. */
const GRANT_INTERVAL_MS = 50;

export interface StudioOfTest {
  studio: Studio;
  stop(): void;
}

/** Connects a studio with a program. */
export async function connectStudio(program: Program): Promise<StudioOfTest> {
  const studio = new Studio({
    open: () => new WebSocket(`${program.url.replace(/^http/, "ws")}socket`) as unknown as Socket,
    after: (ms, then) => setTimeout(then, ms),
    cancel: (timer) => clearTimeout(timer as NodeJS.Timeout),
    accessStatus: () => Promise.resolve("in"),
  });
  studio.connect();
  await vi.waitUntil(() => studio.isConnected, { timeout: 20_000 });
  const timer = setInterval(() => studio.sessions.forEach((one) => one.frames.grantHidden()), GRANT_INTERVAL_MS);
  return { studio, stop: () => clearInterval(timer) };
}
