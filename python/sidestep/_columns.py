"""Columns of arrays and data frames for the native module, chunk by chunk and without a copy of their numbers.

Data frames are read by the C stream of Arrow, whose structures these are: https://arrow.apache.org/docs/format/CDataInterface.html
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from ._errors import input_error
from ._native import LogColumns

#: An array of any type.
_Array = NDArray[Any]

#: Number of rows that are taken from a data frame at once where it makes a copy of them.
CHUNK_ROWS = 1 << 18


def log_columns(table: Any, known: Sequence[str]) -> LogColumns:
    """Returns the columns that are known of a dict, a data frame, or anything with an Arrow stream."""
    columns = LogColumns()
    names = _names(table, known)
    if names is None:
        _add_stream(columns, table, known)
    elif isinstance(table, Mapping) or not hasattr(table, "__arrow_c_stream__") or _is_pandas(table):
        for name in names:
            _add_column(columns, name, table[name])
    else:
        for part in _parts(table, names):
            _add_stream(columns, part, names)
    there = columns.names()
    for name in names or []:
        # A data frame without rows has no chunks.
        if name not in there:
            _add_codes(columns, name, np.zeros(0, np.uint8), [], (None, 0))
    if not columns.names():
        raise input_error("columns", f"there is none of {', '.join(known)}", "give a dict of columns or a data frame")
    return columns


def _names(table: Any, known: Sequence[str]) -> list[str] | None:
    """Returns the known columns that a table has; None where only its stream knows."""
    # Arrow's tables have their columns themselves as `columns`.
    keys = getattr(table, "column_names", getattr(table, "columns", None))
    if keys is not None:
        there = list(keys)
        return [name for name in known if name in there]
    if not isinstance(table, Mapping) and hasattr(table, "__arrow_c_stream__"):
        return None
    return [name for name in known if name in table]


def _is_pandas(column: Any) -> bool:
    return hasattr(column, "iloc")


def _parts(table: Any, names: list[str]) -> Iterator[Any]:
    """Returns a data frame in parts with these columns alone."""
    chosen = table.select(names) if hasattr(table, "select") else table
    if hasattr(chosen, "iter_slices"):
        # Polars may turn words into another form for a stream, all those of a part at once.
        return iter(chosen.iter_slices(CHUNK_ROWS))
    return iter([chosen])


def _add_column(columns: LogColumns, name: str, column: Any) -> None:
    if _is_pandas(column):
        if getattr(column, "ndim", 1) != 1:
            raise input_error("columns", f"there is more than one column `{name}`", "keep one of them")
        if not isinstance(column.dtype, np.dtype) and _add_pandas(columns, name, column):
            return
    elif hasattr(column, "__arrow_c_stream__"):
        _add_stream(columns, column, [name], name)
        return
    _add_array(columns, name, _array(column))


def _add_pandas(columns: LogColumns, name: str, column: Any) -> bool:
    """Adds a column with a type of pandas alone, such as categories; returns whether its program can tell it."""
    try:
        for start in range(0, max(len(column), 1), CHUNK_ROWS):
            _add_stream(columns, column.iloc[start : start + CHUNK_ROWS].to_frame(name), [name])
    except ImportError:
        return False
    return True


def _array(column: Any) -> _Array:
    if np.ma.isMaskedArray(column):
        # As an array alone it would have the values behind the mask.
        objects: _Array = np.asarray(column).astype(object)
        objects[np.ma.getmaskarray(column)] = None
        return objects
    # Words in a list have the length of the longest one as an array of characters, of four bytes each.
    if isinstance(column, list | tuple) and column and isinstance(column[0], str):
        return np.array(column, dtype=object)
    return np.asarray(column)


def _add_array(columns: LogColumns, name: str, array: _Array) -> None:
    if array.ndim != 1:
        cause = f"the column `{name}` has the shape {array.shape}"
        raise input_error("columns", cause, "give one value per row")
    kind = array.dtype.kind
    if kind in "iuf":
        if array.dtype.itemsize not in (1, 2, 4, 8) or array.dtype == np.float16:
            array = array.astype(np.float64)
        elif not array.dtype.isnative:
            array = array.astype(array.dtype.newbyteorder("="))
        elif not array.flags.aligned or (array.strides and array.strides[0] % array.dtype.itemsize):
            # A field of a packed record lies between the places of its type.
            array = np.array(array)
        columns.add_numbers(name, array, (None, 0))
    elif kind == "b":
        _add_codes(columns, name, array.view(np.uint8), ["no", "yes"], (None, 0))
    elif kind == "U" and array.dtype.isnative and array.dtype.itemsize:
        characters = np.ascontiguousarray(array).view(np.uint32).reshape(len(array), array.dtype.itemsize // 4)
        columns.add_characters(name, characters)
    else:
        columns.add_objects(name, array.astype(object))


def _add_codes(
    columns: LogColumns, name: str, codes: _Array, words: Sequence[str | None], valid: tuple[_Array | None, int]
) -> None:
    """Adds words by their places, in parts: places of another type are copied."""
    bits, first_bit = valid
    for start in range(0, max(len(codes), 1), CHUNK_ROWS):
        part = codes[start : start + CHUNK_ROWS].astype(np.int64)
        columns.add_codes(name, part, words, (bits, first_bit + start))


class _Schema(ctypes.Structure):
    """ArrowSchema."""


class _Data(ctypes.Structure):
    """ArrowArray."""


class _Stream(ctypes.Structure):
    """ArrowArrayStream."""


_Release = ctypes.CFUNCTYPE(None, ctypes.c_void_p)
_Schema._fields_ = [
    ("format", ctypes.c_char_p),
    ("name", ctypes.c_char_p),
    ("metadata", ctypes.c_void_p),
    ("flags", ctypes.c_int64),
    ("n_children", ctypes.c_int64),
    ("children", ctypes.POINTER(ctypes.POINTER(_Schema))),
    ("dictionary", ctypes.POINTER(_Schema)),
    ("release", ctypes.c_void_p),
    ("private_data", ctypes.c_void_p),
]
_Data._fields_ = [
    ("length", ctypes.c_int64),
    ("null_count", ctypes.c_int64),
    ("offset", ctypes.c_int64),
    ("n_buffers", ctypes.c_int64),
    ("n_children", ctypes.c_int64),
    ("buffers", ctypes.POINTER(ctypes.c_void_p)),
    ("children", ctypes.POINTER(ctypes.POINTER(_Data))),
    ("dictionary", ctypes.POINTER(_Data)),
    ("release", ctypes.c_void_p),
    ("private_data", ctypes.c_void_p),
]
_Stream._fields_ = [
    ("get_schema", ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)),
    ("get_next", ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)),
    ("get_last_error", ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.c_void_p)),
    ("release", ctypes.c_void_p),
    ("private_data", ctypes.c_void_p),
]

#: Types of NumPy by the formats of Arrow. Times are compared at most, so their integers do.
_NUMBERS = {
    "c": np.int8, "C": np.uint8, "s": np.int16, "S": np.uint16, "i": np.int32, "I": np.uint32, "l": np.int64,
    "L": np.uint64, "e": np.float16, "f": np.float32, "g": np.float64, "tdD": np.int32, "tdm": np.int64,
    "tts": np.int32, "ttm": np.int32, "ttu": np.int64, "ttn": np.int64,
}  # fmt: skip
_TIMES = ("ts", "tD")


_Struct = TypeVar("_Struct", _Schema, _Data)


class _Owned(Generic[_Struct]):
    """A structure of Arrow that is released when nobody refers to it any more."""

    def __init__(self, struct: _Struct) -> None:
        self.struct: _Struct = struct

    def __del__(self) -> None:
        if self.struct.release:
            _Release(self.struct.release)(ctypes.addressof(self.struct))


def _add_stream(columns: LogColumns, source: Any, names: Sequence[str], alone: str | None = None) -> None:
    """Adds the columns with these names; `alone` is the name of a source that is one column itself."""
    capsule = source.__arrow_c_stream__()
    pointer = ctypes.pythonapi.PyCapsule_GetPointer
    pointer.restype, pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    stream = _Stream.from_address(pointer(capsule, b"arrow_array_stream"))
    schema = _Owned(_Schema())
    _call(stream, stream.get_schema, schema)
    while True:
        batch = _Owned(_Data())
        _call(stream, stream.get_next, batch)
        if not batch.struct.release:
            break
        if alone is not None:
            _Chunk(columns, alone, schema.struct, batch.struct, 0, batch).add()
            continue
        for k in range(schema.struct.n_children):
            field = schema.struct.children[k].contents
            name = (field.name or b"").decode()
            if name in names:
                # The rows of a batch may begin behind those of its columns.
                start = batch.struct.offset
                _Chunk(columns, name, field, batch.struct.children[k].contents, start, batch).add(batch.struct.length)


def _call(stream: _Stream, function: Callable[[int, int], int], into: _Owned[_Schema] | _Owned[_Data]) -> None:
    if function(ctypes.addressof(stream), ctypes.addressof(into.struct)):
        message = stream.get_last_error(ctypes.addressof(stream)) or b"its stream ended with an error"
        raise input_error("columns", message.decode(errors="replace"), "give a table that can be read")


class _Chunk:
    """A column of one batch."""

    def __init__(
        self, columns: LogColumns, name: str, field: _Schema, data: _Data, start: int, owner: _Owned[_Data]
    ) -> None:
        self.columns, self.name, self.field, self.data, self.owner = columns, name, field, data, owner
        self.format = field.format.decode()
        self.start = data.offset + start
        self.length = data.length - start

    def add(self, length: int | None = None) -> None:
        if length is not None:
            self.length = length
        if self.field.dictionary:
            codes = self._cells(1, _NUMBERS[self.format])
            _add_codes(self.columns, self.name, codes, self._dictionary(), self._validity())
        elif self.format == "n":
            _add_codes(self.columns, self.name, np.zeros(self.length, np.uint8), [None], (None, 0))
        elif self.format == "b":
            first, end = self.start, self.start + self.length
            bits = np.unpackbits(self._buffer(1, -(-end // 8), np.uint8), bitorder="little")[first:end]
            _add_codes(self.columns, self.name, bits, ["no", "yes"], self._validity())
        elif self.format in ("u", "U"):
            self._add_texts()
        elif self.format == "vu":
            self._add_views()
        else:
            self._add_numbers()

    def _add_numbers(self) -> None:
        time = np.int64 if self.format.startswith(_TIMES) else None
        dtype = _NUMBERS.get(self.format, time)
        if dtype is None:
            cause = f"the column `{self.name}` has the type `{self.format}` of Arrow"
            raise input_error("columns", cause, "turn it into numbers or words before")
        cells = self._cells(1, dtype)
        # Half as many bits as any type that is read in place.
        cells = cells.astype(np.float32) if dtype == np.float16 else cells
        self.columns.add_numbers(self.name, cells, self._validity())

    def _add_texts(self) -> None:
        dtype = np.int32 if self.format == "u" else np.int64
        offsets = self._buffer(1, self.start + self.length + 1, dtype)[self.start :]
        if not self.length:
            offsets = np.zeros(1, np.int64)
        characters = self._buffer(2, int(offsets[-1]), np.uint8)
        bits, first_bit = self._validity()
        for row in range(0, max(self.length, 1), CHUNK_ROWS):
            part = offsets[row : row + CHUNK_ROWS + 1].astype(np.int64)
            self.columns.add_texts(self.name, part, characters, (bits, first_bit + row))

    def _add_views(self) -> None:
        views = self._buffer(1, 16 * (self.start + self.length), np.uint8)[16 * self.start :]
        count = self.data.n_buffers - 3
        sizes = self._buffer(self.data.n_buffers - 1, count, np.int64)
        buffers = [self._buffer(2 + k, int(sizes[k]), np.uint8) for k in range(count)]
        self.columns.add_views(self.name, views.reshape(-1, 16), buffers, self._validity())

    def _dictionary(self) -> list[str | None]:
        """Returns the words of a dictionary."""
        field, data = self.field.dictionary.contents, self.data.dictionary.contents
        values = LogColumns()
        _Chunk(values, self.name, field, data, 0, self.owner).add()
        return values.texts(self.name)

    def _cells(self, index: int, dtype: Any) -> _Array:
        return self._buffer(index, self.start + self.length, dtype)[self.start :]

    def _validity(self) -> tuple[_Array | None, int]:
        """Returns a bit per row, 0 where its value is missing, and the place of the first; None where all are there."""
        if self.data.null_count == 0 or not self.data.buffers[0]:
            return None, 0
        return self._buffer(0, -(-(self.start + self.length) // 8), np.uint8), self.start

    def _buffer(self, index: int, count: int, dtype: Any) -> _Array:
        """Returns a buffer of the column as an array, which keeps its batch."""
        address = self.data.buffers[index]
        size = count * np.dtype(dtype).itemsize
        if not address or not size:
            return np.zeros(count, dtype)
        raw = (ctypes.c_uint8 * size).from_address(address)
        raw.owner = self.owner
        array: _Array = np.frombuffer(raw, dtype)
        array.flags.writeable = False
        return array
