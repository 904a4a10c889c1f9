/** Serves the built page with made-up worlds, to try it by hand: `npm run fake`, then open the address; Ctrl-C ends it. */

import { test } from "vitest";
import { FakeServer } from "./server";

const DAY_S = 86_400;

test("the fake server serves until it is stopped", { timeout: 2000 * DAY_S }, async () => {
  const server = new FakeServer("dist");
  server.port = Number(process.env.PORT ?? 7920);
  await server.start();
  console.log(server.url);
  await new Promise((over) => setTimeout(over, 1000 * Number(process.env.SERVE_S ?? DAY_S)));
  await server.stop();
});
