"""Fleets: a world at a server, and its agents as processes."""

from __future__ import annotations

import json
import os
import queue
import shutil
import subprocess
import sys
import tempfile
import threading
import weakref
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

from . import _native, _notebook
from ._errors import FleetError, checked_int, input_error
from ._native import Scenario

#: The program beside the command that alone contains the network stack, and the variable that may hold its path.
PROGRAM = "sidestep-link"
PATH_VARIABLE = "SIDESTEP_LINK"
#: One heap for all threads of the program: by default glibc gives it a dozen, and none of them shrinks.
ONE_HEAP = ("MALLOC_ARENA_MAX", "1")
#: Seconds that a program has to end in good order after it was asked to: a cycle of many agents takes some.
END_TIMEOUT_S = 60.0
#: Last lines of the log that an error shows.
SHOWN_LOG_LINES = 5


@dataclass(frozen=True)
class NodeStatus:
    """A node of a fleet at one moment."""

    #: Id of its agent on the network.
    agent: int
    #: Name of its agent, e.g. ``"3"``, or ``"0.3"`` for connector 3 of chain 0.
    name: str
    #: ``awaited``, ``joined``, ``gone``, ``silent`` if it was not heard for a second, or its part in the cycle.
    state: str
    #: System id of its process on its machine; None before it has joined.
    process: int | None
    #: Number of other agents that it has heard in the last cycle.
    heard: int
    #: Number of its controls that were carried out.
    flown: int
    #: Number of its controls that came late, or not at all.
    late: int
    #: Number of times that it has joined.
    lives: int
    #: Packets that it has sent, and their bytes.
    packets: int
    bytes: int
    #: Bytes of all frames that it has sent: packets, controls and its status.
    frame_bytes: int
    #: Processor time in milliseconds that its process has used since its first cycle; None where its system does not tell.
    processor_ms: int | None
    #: Seconds since it was last heard; None before it has joined.
    silent_s: float | None


@dataclass(frozen=True)
class FleetStatus:
    """A fleet at one moment, as :class:`Fleet` yields it."""

    #: Cycles done, and those planned.
    cycle: int
    cycles: int
    #: Whether all nodes have joined.
    has_begun: bool
    #: Number of cycles that began late, in real time.
    late_cycles: int
    #: Seconds of real time since all nodes had joined; 0 before.
    flown_s: float
    #: Median time in milliseconds from the percepts to the last control, and that below which 99 of 100 are; None before
    #: the first cycle.
    talk_p50_ms: float | None
    talk_p99_ms: float | None
    #: Bytes of all frames that the server has sent, percepts for the most part.
    server_frame_bytes: int
    #: What an agent of the world is called, e.g. ``"airplane"``.
    noun: str
    #: Names of the agents for which all wait, because their nodes are not heard.
    waits_for: list[str]
    #: The nodes, by rising id.
    nodes: list[NodeStatus]

    @property
    def late(self) -> int:
        """Number of controls that came late, or not at all, of all nodes."""
        return sum(node.late for node in self.nodes)

    def _repr_html_(self) -> str:
        heads = ("node", "state", "flown", "late", "packets", "bytes")
        cells = ((node.name, node.state, node.flown, node.late, node.packets, node.bytes) for node in self.nodes)
        return _notebook.rows(heads, cells, f"cycle {self.cycle} of {self.cycles}")


class Fleet:
    """A fleet that is flown: a world at a server, and each of its agents as a process, as ``sidestep fleet`` does it.

    It starts at once. Iterate over it to watch it, :meth:`wait` for its end, or :meth:`end` it before; as a context it ends
    with the block. No process is left over, however this one ends. In lockstep it comes out as
    ``Simulation(scenario).run()`` does, bit for bit. The program ``sidestep-link`` does it: build it with
    ``cargo install --path crates/link``.

    ``scenario`` is a file, a dict, or a :class:`Scenario`; ``set`` has changes of it, as :meth:`Scenario.set` takes them.
    ``nodes`` is the number of nodes to start here, of the agents with the lowest ids (all); the fleet waits for the others,
    which ``sidestep node`` starts elsewhere, with the scenario as a file. ``clock`` is ``"lockstep"``, which waits for every
    agent, or ``"realtime"``, where each cycle is a deadline and time passes ``speed`` times as fast. ``topology`` is
    ``"mesh"``, ``"star"`` or ``"multicast"`` (by default that where all nodes are started here, else a mesh). ``listen`` has
    endpoints of the server (any free port of this machine). ``out`` is the folder of the recorded run, ``replace`` allows to
    overwrite one, ``packets`` records every packet there. ``lease_s`` is the silence in seconds after which a party is taken
    to be gone, ``insecure`` allows links without certificates that leave this machine, ``tls`` has the files of
    certificates: ``(authority, certificate, key)``. ``log`` is the least severe log level that :attr:`log` keeps.

    Raises InputError for wrong arguments, and where the program is not found. What is wrong with the scenario for a fleet is
    raised by :meth:`wait`, and by iterating.

    >>> import sidestep
    >>> with sidestep.Fleet("office.toml", clock="realtime", speed=50.0) as fleet:  # doctest: +SKIP
    ...     for status in fleet:
    ...         print(status.cycle, status.late)
    ...     summary = fleet.wait()
    """

    def __init__(
        self,
        scenario: Scenario | str | os.PathLike[str] | Mapping[str, Any],
        *,
        set: Mapping[str, Any] | None = None,
        nodes: int | None = None,
        clock: Literal["lockstep", "realtime"] = "lockstep",
        speed: float = 1.0,
        topology: Literal["mesh", "star", "multicast"] | None = None,
        listen: Sequence[str] = (),
        out: str | os.PathLike[str] | None = None,
        replace: bool = False,
        packets: bool = False,
        lease_s: float = 10.0,
        insecure: bool = False,
        tls: tuple[str | os.PathLike[str], str | os.PathLike[str], str | os.PathLike[str]] | None = None,
        log: str = "warn",
    ) -> None:
        if clock not in ("lockstep", "realtime"):
            raise input_error("clock", f"is {clock!r}", 'give "lockstep" or "realtime"')
        if topology not in (None, "mesh", "star", "multicast"):
            raise input_error("topology", f"is {topology!r}", 'give "mesh", "star" or "multicast"')
        if isinstance(listen, str):
            raise input_error("listen", f"is {listen!r}", f"give a list: [{listen!r}]")
        if (packets or replace) and out is None:
            raise input_error("packets" if packets else "replace", "needs a folder", "give out, too")
        program = _find_program()
        self._folder = tempfile.TemporaryDirectory(prefix="sidestep-fleet-")
        protocol = "tcp" if tls is None else "tls"
        is_local = nodes is None and not listen and tls is None
        if topology is None:
            topology = "multicast" if is_local and _native.has_loopback_multicast() else "mesh"
        job = {
            "common": {
                "flown": {
                    "file": str(_scenario_file(scenario, set, Path(self._folder.name))),
                    "overrides": [],
                    "build": _native.build(),
                },
                "tls": None
                if tls is None
                else dict(zip(("authority", "certificate", "key"), map(_absolute, tls), strict=True)),
                "is_insecure": bool(insecure),
                "lease_s": _checked_float("lease_s", lease_s, 0.1, 86_400.0),
                "metrics": None,
                "json_log": False,
                "log": str(log),
            },
            "nodes": None if nodes is None else checked_int("nodes", nodes, 0, 1_000_000),
            "clock": "lockstep"
            if clock == "lockstep"
            else {"realtime": {"speed": _checked_float("speed", speed, 0.01, 1000.0)}},
            "topology": topology,
            "multicast_group": None,
            "listen": list(listen) or [f"{protocol}/127.0.0.1:0"],
            "out": None if out is None else _absolute(out),
            "replace": bool(replace),
            "packets": bool(packets),
        }
        #: The endpoints at which the server listens; empty before it does.
        self.listens: list[str] = []
        #: The last status; None before the first one.
        self.status: FleetStatus | None = None
        #: The summary of the run, as in ``summary.json``; None before the end.
        self.summary: dict[str, Any] | None = None
        #: The lines that server and nodes have logged.
        self.log: list[str] = []
        self._error: dict[str, Any] | None = None
        self._messages: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()
        self._process = _start(program)
        stdin = self._process.stdin
        assert stdin is not None
        _OPEN_PIPES.add(stdin)
        # A fleet that nobody has any more ends, as one whose process has ended.
        self._finalizer = weakref.finalize(self, _close, stdin)
        threading.Thread(target=_read_messages, args=(self._process.stdout, self._messages), daemon=True).start()
        self._logger = threading.Thread(target=_read_log, args=(self._process.stderr, self.log), daemon=True)
        self._logger.start()
        try:
            stdin.write(json.dumps({"fleet": job}).encode() + b"\n")
            stdin.flush()
        except BrokenPipeError:
            # It has ended, and its own message says why.
            pass

    def __iter__(self) -> Iterator[FleetStatus]:
        """Yields the status of the fleet twice a second, until it has ended.

        Raises InputError, RecordError or FleetError when it fails.
        """
        while True:
            message = self._messages.get()
            if message is None:
                # For whoever asks again.
                self._messages.put(None)
                self._finish()
                return
            before = self.status
            self._take(message)
            if self.status is not None and self.status is not before:
                yield self.status

    def wait(self) -> dict[str, Any]:
        """Waits until the fleet has ended, and returns its summary.

        Raises InputError when its input is wrong, and FleetError when it fails. Ctrl-C ends the fleet in good order.

        >>> fleet.wait()["digest"]  # doctest: +SKIP
        '7f2a840188d623ea0ca6f30d201bb60d'
        """
        try:
            for _ in self:
                pass
        except KeyboardInterrupt:
            self.end()
            raise
        if self.summary is None:
            raise FleetError("the fleet was ended before it had a result")
        return self.summary

    def end(self) -> None:
        """Asks the fleet to end in good order, and waits for that; an ended one stays as it is.

        What was flown is in :attr:`summary` and in the folder ``out``.

        >>> fleet.end()  # doctest: +SKIP
        >>> fleet.is_over  # doctest: +SKIP
        True
        """
        self._finalizer()
        for message in iter(self._messages.get, None):
            self._take(message)
        self._messages.put(None)
        self._close_process()

    @property
    def is_over(self) -> bool:
        """Whether all of its processes have ended."""
        return self._process.poll() is not None

    def __enter__(self) -> Fleet:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()

    def __repr__(self) -> str:
        if self.status is None:
            return "Fleet(starting)" if not self.is_over else "Fleet(over)"
        state = "over" if self.is_over else "flying"
        return f"Fleet({state}, cycle {self.status.cycle} of {self.status.cycles}, {len(self.status.nodes)} nodes)"

    def _repr_html_(self) -> str:
        return repr(self) if self.status is None else self.status._repr_html_()

    def _take(self, message: dict[str, Any]) -> None:
        match message:
            case {"listens": endpoints}:
                self.listens = endpoints
            case {"fleet": status}:
                self.status = _status(status)
            case {"ended": ended}:
                self.summary = ended["summary"]
                self.status = _status(ended["fleet"])
            case {"failed": error}:
                self._error = error

    def _close_process(self) -> int:
        self._finalizer()
        try:
            code = self._process.wait(END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        self._logger.join(END_TIMEOUT_S)
        self._folder.cleanup()
        return code

    def _finish(self) -> None:
        """Raises what has gone wrong, if anything has."""
        code = self._close_process()
        error = self._error
        if error is None:
            if code != 0:
                lines = "\n".join(self.log[-SHOWN_LOG_LINES:])
                raise FleetError(f"{PROGRAM} has ended with code {code}\n{lines}".rstrip())
            return
        if error["is_interrupted"]:
            return
        if error["is_input"]:
            raise input_error(error["place"], error["cause"], error["remedy"])
        raise FleetError(f"{error['cause']}\n  help: {error['remedy']}")


#: Standard inputs of programs that run. A process that is forked has a copy of each, by which a fleet would outlive the
#: one that has started it.
_OPEN_PIPES: weakref.WeakSet[Any] = weakref.WeakSet()


def _close_copies() -> None:
    for pipe in list(_OPEN_PIPES):
        _close(pipe)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_close_copies)


def _close(pipe: Any) -> None:
    """Closes the standard input of a program, which asks it to end."""
    try:
        pipe.close()
    except OSError:
        # What was not written is for a program that has ended.
        pass


def _find_program() -> str:
    given = os.environ.get(PATH_VARIABLE)
    # Who has set the variable wants no other program in its place.
    beside = Path(sys.executable).with_name(PROGRAM)
    found = given if given else shutil.which(PROGRAM) or (str(beside) if beside.is_file() else None)
    if found is None or not Path(found).is_file():
        remedy = f"build it with `cargo install --path crates/link`; {PATH_VARIABLE} may hold its path"
        raise input_error(PROGRAM, "not found; fleet networking is a separate program", remedy)
    return found


def _start(program: str) -> subprocess.Popen[bytes]:
    name, value = ONE_HEAP
    pipe = subprocess.PIPE
    # In a session of its own: Ctrl-C is for this process, which asks the fleet to end.
    return subprocess.Popen(
        [program],
        stdin=pipe,
        stdout=pipe,
        stderr=pipe,
        env={name: value, **os.environ},
        start_new_session=True,
    )


def _scenario_file(
    scenario: Scenario | str | os.PathLike[str] | Mapping[str, Any], changes: Mapping[str, Any] | None, folder: Path
) -> Path:
    """Returns a file with the scenario: the given one, or else one that is written into the folder."""
    if isinstance(scenario, str | os.PathLike) and not changes:
        return Path(scenario).absolute()
    compiled = scenario if isinstance(scenario, Scenario) else Scenario(scenario)
    if changes:
        compiled = compiled.set(changes)
    # As it is pickled: its text, with all changes, and the files to which it refers.
    packed: tuple[Any, tuple[str, list[tuple[str, bytes]]]] = compiled.__reduce__()  # type: ignore[assignment]
    _, (text, files) = packed
    for name, content in files:
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
    written = folder / "scenario.toml"
    written.write_text(text, encoding="utf-8")
    return written


def _absolute(path: str | os.PathLike[str]) -> str:
    return str(Path(path).absolute())


def _checked_float(name: str, value: float, low: float, high: float) -> float:
    number = float(value)
    # NaN is in no range.
    if not low <= number <= high:
        raise input_error(name, f"is {value!r}", f"give a number from {low:g} to {high:g}")
    return number


def _status(status: dict[str, Any]) -> FleetStatus:
    nodes = [NodeStatus(**_fields(NodeStatus, node)) for node in status["nodes"]]
    return FleetStatus(**{**_fields(FleetStatus, status), "nodes": nodes})


def _fields(kind: type[Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Returns those of the values that are fields of a data class."""
    return {field.name: values[field.name] for field in fields(kind)}


def _read_messages(lines: Any, messages: queue.SimpleQueue[dict[str, Any] | None]) -> None:
    for line in lines:
        try:
            messages.put(json.loads(line))
        except ValueError:
            # No line of the program's language.
            continue
    messages.put(None)


def _read_log(lines: Any, log: list[str]) -> None:
    for line in lines:
        log.append(line.decode(errors="replace").rstrip())
