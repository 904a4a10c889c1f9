import "./theme.css";
import { mount } from "svelte";
import App from "./App.svelte";
import { signIn, fetchAccessStatus } from "./auth";
import type { Socket } from "./connection";
import { followLink } from "./replay/link.svelte";
import { embeddedParts } from "./replay/parts";
import { ReplaySocket } from "./replay/socket";
import { Studio, type StudioEnvironment } from "./state/studio.svelte";

/** The server's socket, at the address that the page itself came from. */
function open(): Socket {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  return new WebSocket(`${scheme}://${location.host}/socket`) as unknown as Socket;
}

const timers: Pick<StudioEnvironment, "after" | "cancel"> = {
  after: (ms, then) => setTimeout(then, ms),
  cancel: (timer) => clearTimeout(timer as number | undefined),
};
const parts = embeddedParts(document);
const studio = new Studio(
  parts === null
    ? { ...timers, open, accessStatus: fetchAccessStatus }
    : { ...timers, open: () => new ReplaySocket(parts), accessStatus: () => Promise.resolve("in"), isReplay: true },
);

mount(App, { target: document.getElementById("app")!, props: { studio } });
if (parts === null) {
  void signIn().then(() => studio.connect());
} else {
  followLink(studio);
  studio.connect();
}
