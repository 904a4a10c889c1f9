"""Images of environments: as arrays, in a window, or as text."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

RENDER_MODES = ["rgb_array", "human", "ansi"]
#: Columns of an image as text.
TEXT_COLUMNS = 100


def show(image: NDArray[np.uint8], mode: str, title: str) -> Any:
    """Returns an image, or its text; shows it in a window with the mode "human"."""
    if mode == "rgb_array":
        return image
    if mode == "ansi":
        return to_text(image)
    _show_window(image, title)
    return None


def to_text(image: NDArray[np.uint8]) -> str:
    """Returns an image as text for a terminal of 24-bit color: each letter is two points, one above the other."""
    height, width, _ = image.shape
    step = max(width / TEXT_COLUMNS, 1.0)
    rows = 2 * max(round(height / step / 2), 1)
    columns = max(round(width / step), 1)
    points = _shrunk(image, rows, columns)
    lines = []
    for above, below in zip(points[0::2], points[1::2], strict=True):
        line, last = "", None
        for (r, g, b), (red, green, blue) in zip(above.tolist(), below.tolist(), strict=True):
            colors = f"\x1b[38;2;{r};{g};{b};48;2;{red};{green};{blue}m"
            # Colors stand until others are given.
            line += "▀" if colors == last else f"{colors}▀"
            last = colors
        lines.append(f"{line}\x1b[0m")
    return "\n".join(lines) + "\n"


def _shrunk(image: NDArray[np.uint8], rows: int, columns: int) -> NDArray[np.uint8]:
    """Returns an image of so many points, each the mean of those that it stands for."""
    height, width, _ = image.shape
    down = np.add.reduceat(image.astype(np.float64), np.arange(rows) * height // rows, axis=0)
    across = np.add.reduceat(down, np.arange(columns) * width // columns, axis=1)
    heights = np.diff(np.append(np.arange(rows) * height // rows, height))
    widths = np.diff(np.append(np.arange(columns) * width // columns, width))
    means: NDArray[np.uint8] = (across / (heights[:, None, None] * widths[None, :, None])).astype(np.uint8)
    return means


def _show_window(image: NDArray[np.uint8], title: str) -> None:
    try:
        import matplotlib.pyplot as pyplot
    except ImportError as error:
        raise ImportError("windows need Matplotlib: pip install 'matplotlib>=3.7'") from error
    figure = pyplot.figure(title, figsize=(image.shape[1] / 100, image.shape[0] / 100))
    figure.clear()
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.imshow(image)
    # Long enough for the window to be drawn, too short to slow a learner down.
    pyplot.pause(0.001)
