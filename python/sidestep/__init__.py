"""Simulation of many agents that must not collide: robots on a grid, chains, airplanes.

The same scenario and seed give the same bits for any number of workers, in the command, the Rust library and Python.

>>> import sidestep
>>> scenario = sidestep.Scenario({
...     "world": "robots",
...     "map": {"ascii": "......\\n......\\n......"},
...     "robots": [{"count": 3, "behaviour": {"kind": "external"}}],
... })
>>> sim = sidestep.Simulation(scenario, seed=7)
>>> sim.order("action", 0)        # all move forward
>>> sim.step()
1
>>> sorted(sim.observe())
['at_boxes', 'contact', 'contact_side', 'due', 'heading']
"""

from . import collectives, learn, stats
from ._agents import Agent, Each, each
from ._arm import ArmTrajectory, FkResult, IkResult, fk, ik, trajectories
from ._errors import (
    CheckpointError,
    ClosedError,
    EngineError,
    FleetError,
    InputError,
    OrderError,
    RecordError,
    ReplayError,
    SidestepError,
)
from ._fleet import Fleet, FleetStatus, NodeStatus
from ._inspect import Finding, ImportReport, inspect
from ._native import (
    Arm,
    Batch,
    Blocks,
    Scenario,
    Simulation,
    Space,
    Table,
    Team,
    __version__,
    schema,
    worlds,
)
from ._read import Tables, read
from ._status import SweepStatus, sweep_status
from ._sweep import Comparison, Sweep, compare, sweep
from .datasets import to_minari

__all__ = [
    "Agent",
    "Arm",
    "ArmTrajectory",
    "Batch",
    "Blocks",
    "CheckpointError",
    "ClosedError",
    "Comparison",
    "Each",
    "EngineError",
    "Finding",
    "FkResult",
    "Fleet",
    "FleetError",
    "FleetStatus",
    "IkResult",
    "ImportReport",
    "InputError",
    "NodeStatus",
    "OrderError",
    "RecordError",
    "ReplayError",
    "Scenario",
    "SidestepError",
    "Simulation",
    "Space",
    "Sweep",
    "SweepStatus",
    "Table",
    "Tables",
    "Team",
    "__version__",
    "collectives",
    "compare",
    "each",
    "fk",
    "ik",
    "inspect",
    "learn",
    "read",
    "schema",
    "stats",
    "sweep",
    "sweep_status",
    "to_minari",
    "trajectories",
    "worlds",
]
