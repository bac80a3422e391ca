"""A record as files: one a stream, in the layout that the log readers take."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import STATE, WRITTEN_STATE, Record, Stream
from estimfw.run.files import write_bytes, write_text

__all__ = ["grouped_columns", "write_record"]

FloatArray = NDArray[np.float64]


def write_record(record: Record, folder: Path, kind: str, *, force: bool) -> list[Path]:
    """Write ``<stream>.npz`` (or ``.csv``) and ``truth.npz``.

    An NPZ holds ``t`` (N,) s, ``dt`` s where the stream has a period, and the columns: those that end in ``_x, _y, _z`` as one
    array (N, 3) under their common name. A CSV has a header line with the columns' names.

    Raises
    ------
    DataError
        A file exists and ``force`` is not given, or cannot be written.
    """
    written = []
    for stream in record.streams.values():
        path = folder / f"{stream.name}.{kind}"
        if kind == "csv":
            written.append(write_text(path, _csv(stream), force=force))
        else:
            period = {"dt": np.array(stream.period)} if stream.period is not None else {}
            written.append(
                write_bytes(path, _npz({"t": stream.time, **period, **grouped_columns(stream)}), force=force)
            )
    if record.truth is not None:
        truth = {_written(name): np.asarray(value) for name, value in record.truth.values.items()}
        written.append(write_bytes(folder / "truth.npz", _npz({"t": record.truth.time, **truth}), force=force))
    return written


def _written(name: str) -> str:
    """The name of a truth in the archive, from which `estimfw.data.record.truth_name` finds back."""
    return WRITTEN_STATE + name.removeprefix(STATE) if name.startswith(STATE) else name


def grouped_columns(stream: Stream) -> dict[str, FloatArray]:
    """Arrays by name: triads ``a_x, a_y, a_z`` as (N, 3) under ``a``, other columns (N,) under their own."""
    arrays: dict[str, FloatArray] = {}
    for name in dict.fromkeys(c.removesuffix("_x").removesuffix("_y").removesuffix("_z") for c in stream.columns):
        triad = [f"{name}_{axis}" for axis in "xyz"]
        if all(c in stream.columns for c in triad):
            arrays[name] = stream.values[:, [stream.columns.index(c) for c in triad]]
    grouped = {f"{name}_{axis}" for name in arrays for axis in "xyz"}
    arrays |= {c: stream.values[:, i] for i, c in enumerate(stream.columns) if c not in grouped}
    return arrays


def _npz(arrays: dict[str, FloatArray]) -> bytes:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()


def _csv(stream: Stream) -> str:
    import pandas as pd

    table = pd.DataFrame(np.column_stack([stream.time, stream.values]), columns=["time", *stream.columns])
    return str(table.to_csv(index=False, float_format="%.17g"))
