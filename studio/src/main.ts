import "./theme.css";
import { mount } from "svelte";
import App from "./App.svelte";
import { signIn, fetchAccessStatus } from "./auth";
import type { Socket } from "./connection";
import { Studio } from "./state/studio.svelte";

/** The server's socket, at the address that the page itself came from. */
function open(): Socket {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  return new WebSocket(`${scheme}://${location.host}/socket`) as unknown as Socket;
}

const studio = new Studio({
  open,
  after: (ms, then) => setTimeout(then, ms),
  cancel: (timer) => clearTimeout(timer as number | undefined),
  accessStatus: fetchAccessStatus,
});

mount(App, { target: document.getElementById("app")!, props: { studio } });
void signIn().then(() => studio.connect());
