"""Features: what an agent of a task observes, as float32 numbers from -1 to 1 at fixed places."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._native import Space

Arrays = Mapping[str, NDArray[Any]]
"""Observations of all agents of all worlds, by name: a row for each agent."""


@dataclass(frozen=True)
class Feature:
    """Some numbers of an observation, one beside the other."""

    #: Its name: letters of lower case, digits and ``_``.
    name: str
    #: The meaning of each number.
    parts: tuple[str, ...]
    #: Computes them: an array of the shape (agents, numbers), or (agents,) of a single number.
    values: Callable[[Arrays], NDArray[Any]]


def scaled(name: str, meaning: str, values: Callable[[Arrays], NDArray[Any]], low: float, high: float) -> Feature:
    """Returns a number that goes from -1 at ``low`` to 1 at ``high``, and no farther."""

    def scale(arrays: Arrays) -> NDArray[Any]:
        return np.clip((values(arrays) - low) * (2.0 / (high - low)) - 1.0, -1.0, 1.0)

    return Feature(name, (f"{meaning}: -1 at {low:g}, 1 at {high:g}",), scale)


def one_hot(name: str, space: Space, among: Sequence[str] | None = None) -> Feature:
    """Returns a number for each word of a space, or for those of ``among``: 1 for the word that holds, else 0."""
    choices = space.choices or []
    words = list(choices if among is None else among)
    table = np.array([[float(choice == word) for word in words] for choice in choices], np.float32)

    def lookup(arrays: Arrays) -> NDArray[Any]:
        return table[arrays[space.name]]

    return Feature(name, tuple(f"{space.meaning}: 1 if {word}" for word in words), lookup)


def vector(name: str, meaning: str, values: Callable[[Arrays], NDArray[Any]], full_m: float, axes: str) -> Feature:
    """Returns a vector that is shortened to the length of 1 where it is longer than ``full_m``."""

    def shorten(arrays: Arrays) -> NDArray[Any]:
        vectors = values(arrays) / full_m
        length = np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True))
        return np.asarray(vectors / np.maximum(length, 1.0))

    parts = tuple(f"{meaning}, {axis}, in units of {full_m:g} m; at most 1 long" for axis in axes.split())
    return Feature(name, parts, shorten)


def rotated(vectors: NDArray[Any], angle_rad: NDArray[Any]) -> NDArray[Any]:
    """Returns vectors in the plane, turned by an angle counterclockwise; shapes (..., 2) and (...)."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)
