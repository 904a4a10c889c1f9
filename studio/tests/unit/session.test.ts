/** The parts of a session work together. */

import { expect, test } from "vitest";
import type { BodyTable, RunEvent, Scene, SessionStatus } from "../../src/protocol";
import { Session } from "../../src/state/session.svelte";
import { FakeHost } from "./host";

const SCENE = { world: "robots", name: "Hall", cycle_s: 0.1, is_recording: false } as Scene;
const STATUS = { state: "paused", cycle: 0, cycles_planned: 100, seed: "7" } as SessionStatus;

function openSession(): { session: Session; host: FakeHost } {
  const host = new FakeHost();
  const session = new Session({ kind: "new", world: "robots" }, host);
  session.onOpened({ is: "opened", session: 1, scene: SCENE, status: STATUS });
  session.onBodyTable({
    session: 1,
    id: 1,
    kinds: ["robot", "crate"],
    kind: [0, 1],
    number: [0, 0],
    part: [-1, -1],
    is_agent: [true, false],
    names: [],
    shapes: [{ type: "sphere", radius_m: 1 }],
    shape: [0, 0],
    appearances: [],
    appearance: [0, 0],
  } as unknown as BodyTable);
  return { session, host };
}

function contact(cycle: number, kind = "contact"): RunEvent {
  const body = { kind: "crate", number: 0, part: null };
  const other = { kind: "robot", number: 0, part: null };
  return { cycle, level: "info", kind, body, other, at_m: null, value: null, text: "" } as RunEvent;
}

test("a visit of an event seeks to it and selects its agent", () => {
  const { session, host } = openSession();
  session.visit(contact(12));
  expect(session.selection.body).toEqual({ kind: "robot", number: 0, part: null });
  expect(host.calls("seek")).toEqual([{ do: "seek", cycle: 12 }]);
});

test("a jump skips events of hidden kinds", () => {
  const { session, host } = openSession();
  session.events.add([contact(3, "turn"), contact(8)]);
  session.events.toggleKind("turn");
  session.jump(1);
  expect(host.calls("seek")).toEqual([{ do: "seek", cycle: 8 }]);
});

test("a restart clears what belongs to the previous run", async () => {
  const { session, host } = openSession();
  session.events.add([contact(3)]);
  session.onEnded({ place: "run", cause: "it failed", remedy: "restart it" } as never);
  expect(session.run.status.state).toBe("failed");
  const isAccepted = session.restart(9, "seed = 9");
  await host.reply("restart", { is: "opened", session: 1, scene: SCENE, status: { ...STATUS, seed: "9" } });
  expect(await isAccepted).toBe(true);
  expect([session.client.ended, session.events.list, session.seed]).toEqual([null, [], 9]);
  expect([session.run.text, session.run.starts]).toEqual(["seed = 9", 2]);
});
