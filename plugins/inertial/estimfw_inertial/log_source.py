"""A recorded IMU as the source of a record: ``inertial.imu_log``.

The file is read, put into the order of time, cut, bridged over short losses, turned into the axes of the vehicle, and
compared with what a standing IMU must show. Everything that was found and not refused is an event of the record.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from estimfw.data.record import Event, FloatArray, Record, Stream
from estimfw.data.row_order import Rows, in_order
from estimfw.data.sampling import check_rate
from estimfw.errors import ConfigError, DataError, Location
from estimfw.model.nominal import InitialNominal
from estimfw_inertial.log_config import ImuLogConfig
from estimfw_inertial.missing_rows import bridged, gap_events
from estimfw_inertial.mounting import mounting
from estimfw_inertial.place import Place
from estimfw_inertial.readers import CONTENTS, CsvLayout, ImuLog, format_of, read_log
from estimfw_inertial.record_checks import check_standing, check_step
from estimfw_inertial.standing_means import StandingMeans
from estimfw_inertial.stuck_sensor import stuck_events

__all__ = ["ImuLogSource", "build_imu_log"]


@dataclass(frozen=True, slots=True)
class ImuLogSource:
    """A log and what to do with it; ``load`` reads the file anew each time."""

    config: ImuLogConfig
    place: Place | None

    def load(self) -> Record:
        """The stream ``imu``, what the header says of the start, and what was found on the way.

        Raises
        ------
        DataError
            A file that cannot be read or trusted, or a selection without rows.
        """
        config, path = self.config, Path(self.config.file)
        log = read_log(path, self._layout(), config.format)
        rows, events = self._selected(path, log)
        period = self._period(path, log.stream, rows.time)
        events += gap_events(rows, period, config.longest_gap)
        events += stuck_events(rows, period)
        if config.missing == "repeat":
            rows, repeated = bridged(rows, period, config.longest_gap)
            events += repeated
        stream = Stream("imu", rows.time, rows.values, log.stream.columns, "increment", period)
        stream, initial = self._mounted(stream, log.initial)
        events += self._standing_events(path, stream, period)
        events += self._place_events(log.header)
        return Record({"imu": stream}, events=events, initial=initial, attributes=self._attributes(path, log, rows))

    def _mounted(self, stream: Stream, initial: Mapping[str, FloatArray]) -> tuple[Stream, Mapping[str, FloatArray]]:
        """Stream and start attitude in the axes of the vehicle."""
        if self.config.mounting is None:
            return stream, initial
        mounted = mounting(self.config.mounting)
        start = {"C_bn": initial["C_bn"] @ mounted.C.T} if "C_bn" in initial else {}
        return mounted.apply(stream), {**initial, **start}

    def _layout(self) -> CsvLayout:
        c = self.config
        return CsvLayout(
            time=c.columns.time,
            gyro=c.columns.gyro,
            accel=c.columns.accel,
            values=c.values,
            time_unit=c.units.time,
            gyro_unit=c.units.gyro,
            accel_unit=c.units.accel,
            separator=c.separator,
            decimal=c.decimal,
            period=1.0 / c.rate if c.rate is not None else None,
        )

    def _selected(self, path: Path, log: ImuLog) -> tuple[Rows, tuple[Event, ...]]:
        """Rows by number, in order of time, then by time."""
        c, stream = self.config, log.stream
        if c.last_sample is not None and c.last_sample > len(stream):
            raise DataError(
                f"`last_sample` is {c.last_sample}, the log has {len(stream)} samples",
                location=Location(str(path)),
                hint="leave `last_sample` out (`--set source.last_sample=null`) to take the log to its end",
            )
        chosen = slice((c.first_sample or 1) - 1, c.last_sample)
        rows = Rows(str(path), stream.time, stream.values, log.lines).take(chosen)
        rows, events = in_order(rows, c.time_errors)
        inside = rows.between(c.start, c.stop)
        if not inside.time.size:
            raise DataError(
                f"no sample is left by the selection; the log has {len(stream)} from {np.min(stream.time):.10g} s to "
                f"{np.max(stream.time):.10g} s",
                location=Location(str(path)),
                hint="correct `first_sample`, `start`, `stop`",
            )
        return inside, events + self._cut_events(stream, inside.time)

    def _cut_events(self, stream: Stream, used: FloatArray) -> tuple[Event, ...]:
        """What the selection left out: a config that was made for another log shows in it."""
        c = self.config
        said = {"first_sample": c.first_sample, "last_sample": c.last_sample, "start": c.start, "stop": c.stop}
        keys = ", ".join(f"`{key}` {value:g}" for key, value in said.items() if value is not None)
        before = int(np.count_nonzero(stream.time < used[0]))
        after = int(np.count_nonzero(stream.time > used[-1]))
        if not keys or before + after == 0:
            return ()
        text = (
            f"{used.size} of {len(stream)} samples are used, {used[0]:.10g} s to {used[-1]:.10g} s; left out are {before} "
            f"before and {after} after them ({keys})"
        )
        return (Event(float("nan"), "imu", "cut", text, before + after),)

    def _period(self, path: Path, stream: Stream, time: FloatArray) -> float:
        """The configured sampling interval, or that of the file, or that of the time stamps."""
        nominal = 1.0 / self.config.rate if self.config.rate is not None else stream.period
        if nominal is None:
            return check_step(time, Location(str(path)))
        check_rate(time, nominal, Location(str(path)))
        return nominal

    def _standing_events(self, path: Path, stream: Stream, period: float) -> tuple[Event, ...]:
        """What the checks of a standing record flag."""
        config = self.config
        if not config.checks:
            return ()
        kind = format_of(path, config.format)
        return check_standing(
            StandingMeans.of(stream.values, period),
            self.place,
            Location(str(path)),
            tolerance=config.rate_tolerance,
            values=config.values if kind == "csv" else None,
            contents=CONTENTS.get(kind, ""),
        )

    def _place_events(self, header: Mapping[str, float]) -> tuple[Event, ...]:
        if self.place is None or "latitude" not in header:
            return ()
        there = np.degrees([header["latitude"], header["longitude"]])
        here = np.degrees([self.place.latitude, self.place.longitude])
        if abs(there[0] - here[0]) < 0.1 and abs((there[1] - here[1] + 180.0) % 360.0 - 180.0) < 0.1:
            return ()
        text = "latitude and longitude are {:.4f}, {:.4f} deg in the log's header, {:.4f}, {:.4f} deg at the site"
        text = text.format(*there, *here)
        return (Event(float("nan"), "imu", "place", text),)

    def _attributes(self, path: Path, log: ImuLog, rows: Rows) -> dict[str, object]:
        return {
            "file": str(path),
            "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
            "samples": len(log.stream),
            "samples_used": int(rows.time.size),
            "header": dict(log.header),
        }


def build_imu_log(config: ImuLogConfig, site: Place | None, initial: InitialNominal) -> ImuLogSource:
    """The source; ``initial`` is not used, a log does not depend on where the filter starts.

    Raises
    ------
    ConfigError
        Limits that exclude each other.
    """
    del initial
    if config.first_sample and config.last_sample and config.last_sample < config.first_sample:
        raise ConfigError(f"`last_sample` {config.last_sample} comes before `first_sample` {config.first_sample}")
    if config.start is not None and config.stop is not None and config.stop <= config.start:
        raise ConfigError(f"`stop` {config.stop:g} s comes before `start` {config.start:g} s")
    if config.separator == config.decimal:
        raise ConfigError(f"`separator` and `decimal` are both {config.decimal!r}")
    return ImuLogSource(config, site)
