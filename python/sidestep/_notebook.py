"""Output for notebooks: small HTML without scripts, which every front end accepts."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._native import Scenario, Simulation, Table
    from ._read import Tables
    from ._status import SweepStatus
    from ._sweep import Sweep
    from .stats import Paired

#: Rows shown of a table.
MAX_ROWS = 6
#: Measurements shown of a run.
MAX_MEASUREMENTS = 12
#: Metrics shown of a sweep.
MAX_METRICS = 8
#: Width of the drawing of an interval in pixels.
WIDTH_PX = 240.0
#: Its margin in pixels: the circle of the mean and the text below 0 stay inside.
MARGIN_PX = 12.0


def rows(heads: Iterable[str], cells: Iterable[Iterable[Any]], caption: str = "") -> str:
    """Returns a table; ``cells`` has its rows."""
    head = "".join(f"<th>{escape(name)}</th>" for name in heads)
    body = "".join("<tr>" + "".join(f"<td>{escape(_text(cell))}</td>" for cell in row) + "</tr>" for row in cells)
    above = f"<caption>{escape(caption)}</caption>" if caption else ""
    return f"<table>{above}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _text(value: Any) -> str:
    if value is None:
        return "–"
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def _image(png: bytes | None) -> str:
    if png is None:
        return ""
    data = base64.b64encode(png).decode()
    return f'<img alt="the present state, from above" src="data:image/png;base64,{data}"/>'


def scenario(it: Scenario) -> str:
    """Returns the facts and the initial state of a scenario."""
    from ._native import Simulation

    facts: list[tuple[str, Any]] = [("bodies", it.agents), ("seed", it.seed), ("cycles", it.cycles)]
    facts += [("note", remark) for remark in it.check()]
    name = f"{it.world} {it.name}".strip()
    return rows((name, ""), facts) + _image(Simulation(it)._repr_png_())


def simulation(it: Simulation) -> str:
    """Returns the image of a run, and its first measurements."""
    png = it._repr_png_()
    if png is None:
        return f"<p>{escape(repr(it))}</p>"
    numbers = [
        (name, value)
        for name, value in it.metrics().items()
        if isinstance(value, (int, float)) and not isinstance(value, bool)
    ]
    return f"<p>{escape(repr(it))}</p>" + _image(png) + rows(("measured", ""), numbers[:MAX_MEASUREMENTS])


def table(it: Table) -> str:
    """Returns the first rows of a table, with units."""
    heads = [f"{name} ({it.units[name]})" if name in it.units else name for name in it.columns]
    first = it.head(MAX_ROWS)
    return rows(heads, first, f"{it.name}: {len(first)} of {len(it)} rows")


def tables(them: Tables) -> str:
    """Returns the names of the tables of a folder."""
    return rows(("table",), ([name] for name in them), repr(them))


def status(it: SweepStatus) -> str:
    """Returns the shares of a sweep and the remaining time."""
    of = "of at most" if it.until_precise and not it.is_complete else "of"
    caption = f"{it.runs} {of} {it.total} runs, {it.failed} failed"
    if it.eta_s is not None and not it.is_complete:
        caption += f"; about {it.eta_s:.0f} s left"
    shares = [(one["share"], f"{one['runs']} of {one['of']}", one["idle_s"]) for one in it.shares]
    return rows(("share", "runs", "seconds since the last"), shares, caption)


def sweep(it: Sweep) -> str:
    """Returns the means of a sweep's first metrics by variant, with their intervals."""
    names = [variant["name"] for variant in it.summary["variants"]]
    lines = []
    for metric in it.summary["metrics"][:MAX_METRICS]:
        # The mean of numbers, or the proportion of runs in which something is true.
        values = [next(iter(variant["values"].values())) for variant in metric["variants"]]
        lines.append([metric["name"], *map(_estimate, values)])
    return rows(["mean [95 % interval]", *names], lines, repr(it))


def comparison(it: Mapping[str, Any]) -> str:
    """Returns the methods of a comparison, one row each."""
    methods: Sequence[Mapping[str, Any]] = it["methods"]
    names = [name for name, value in methods[0].items() if isinstance(value, Mapping)]
    cells = [[one["method"], one["runs"], *(_estimate(one[name]) for name in names)] for one in methods]
    heads = ["method", "runs", *names]
    return rows(heads, cells, f"{it['name']}, seeds from {it['seed']} on; means with 95 % intervals")


def _estimate(value: Mapping[str, Any]) -> str:
    middle = value.get("mean", value.get("share"))
    interval = value.get("interval")
    if middle is None or interval is None:
        return _text(middle)
    low, high = interval
    return f"{middle:.5g} [{low:.5g}, {high:.5g}]"


def paired(it: Paired) -> str:
    """Returns a paired difference with its interval, drawn beside 0."""
    facts = [("pairs", it.n), ("difference", it.difference), ("p", it.p_value)]
    facts += [("lower", it.lower), ("equal", it.equal), ("higher", it.higher)]
    table = rows((name for name, _ in facts), [[value for _, value in facts]])
    if it.difference is None or it.interval is None:
        return table
    return _interval(it.interval.low, it.difference, it.interval.high) + table


def _interval(low: float, middle: float, high: float) -> str:
    # The drawing always contains 0, because the question is whether the interval does.
    start = min(low, 0.0)
    end = max(high, 0.0)
    scale = (WIDTH_PX - 2 * MARGIN_PX) / ((end - start) or 1.0)
    zero, left, right, dot = (MARGIN_PX + (at - start) * scale for at in (0.0, low, high, middle))
    return (
        f'<svg width="{WIDTH_PX:.0f}" height="40" role="img" aria-label="{middle:.5g} [{low:.5g}, {high:.5g}]">'
        f'<line x1="{zero:.1f}" x2="{zero:.1f}" y1="2" y2="26" stroke="gray"/>'
        f'<line x1="{left:.1f}" x2="{right:.1f}" y1="14" y2="14" stroke="black" stroke-width="2"/>'
        f'<circle cx="{dot:.1f}" cy="14" r="4"/>'
        f'<text x="{zero:.1f}" y="38" font-size="11" text-anchor="middle">0</text></svg>'
    )
