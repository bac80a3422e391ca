"""Which columns of which streams somebody reads, before and after preprocessing, and in which unit.

The measurements and inputs of a plan read the preprocessed record. Going back through the components says what the sources
have to bring: a component with ``needs(wanted)`` maps what is read of its result to what it reads itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from estimfw.config.document import Document
from estimfw.errors import ConfigError
from estimfw.plan.plan import Plan
from estimfw.units import parse_unit, si_name

__all__ = ["Wanted", "read_by", "wanted_columns", "with_columns", "without_columns"]

#: By stream and column its SI unit; empty where nobody says which.
Wanted = Mapping[str, Mapping[str, str]]


def read_by(plan: Plan) -> Wanted:
    """What measurements and inputs read."""
    readers = [(m.stream, m.columns, m.unit) for m in plan.measurements]
    readers += [(known.stream, known.columns, known.unit) for known in plan.inputs]
    wanted: dict[str, dict[str, str]] = {}
    for stream, columns, unit in readers:
        if stream is not None:
            wanted.setdefault(stream, {}).update(dict.fromkeys(columns, unit))
    return wanted


def wanted_columns(plan: Plan, preprocess: Mapping[str, Any], document: Document, provider: Any = None) -> Wanted:
    """What the sources have to bring.

    ``provider`` is the nominal provider: one with ``column_units`` reads its stream from any source, a log for instance.

    Raises
    ------
    ConfigError
        A component makes or reads a column in another unit than its reader.
    """
    wanted = read_by(plan)
    if (units := getattr(provider, "column_units", None)) is not None:
        wanted = with_columns(wanted, provider.stream, dict(zip(provider.columns, units, strict=True)), "stream")
    for name, component in reversed(list(preprocess.items())):
        if hasattr(component, "needs"):
            try:
                wanted = component.needs(wanted)
            except ConfigError as error:
                document.placed(error, ("preprocess", name))
                raise
    return wanted


def with_columns(wanted: Wanted, stream: str, columns: Mapping[str, str], key: str) -> Wanted:
    """``wanted`` and these columns, each with its unit (empty: any); ``key`` is the setting to blame.

    Raises
    ------
    ConfigError
        Somebody reads a column in a unit of another dimension.
    """
    own = dict(wanted.get(stream, {}))
    for column, unit in columns.items():
        read = own.get(column, "")
        if read and unit and parse_unit(read).dimension != parse_unit(unit).dimension:
            raise ConfigError(
                f"the column {column!r} of stream {stream!r} is in {si_name(parse_unit(unit))} here, and is read in {read}",
                hint=f"a unit that gives {read} is due",
                within=(key,),
            )
        own[column] = read or unit
    return {**wanted, stream: own}


def without_columns(
    wanted: Wanted, stream: str, columns: Mapping[str, str], key: str
) -> tuple[Wanted, Mapping[str, str]]:
    """``wanted`` without columns that are made here, and the units in which they are read; see `with_columns`."""
    known = with_columns(wanted, stream, columns, key)[stream]
    rest = {column: unit for column, unit in wanted.get(stream, {}).items() if column not in columns}
    left = {name: read for name, read in wanted.items() if name != stream}
    return ({**left, stream: rest} if rest else left), {column: known[column] for column in columns}
