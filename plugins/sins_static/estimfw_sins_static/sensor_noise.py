"""Are the sensors as quiet as the model says? Sample noise far above the random walks of ``phi_angle`` is flagged.

White noise has one density at every averaging time, vibration fades in long averages and sway in short ones: so the least of
several times is what the sensors can be blamed for. A vehicle that rocks leaves something in all of them, though; where
laser gyros of 0.001 deg/sqrt(h) stood on a real one it was 0.1 deg/sqrt(h) and 300 ug/sqrt(Hz). Less than three times that
is never flagged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from estimfw.config.types import Settings, Site
from estimfw.data.record import Event, Findings, Record, Stream
from estimfw.errors import DataError
from estimfw.model.model import Model

__all__ = ["SensorNoiseConfig", "SensorNoiseMonitor", "sensor_noise", "white_density"]

FloatArray = NDArray[np.float64]

_AVERAGING = (0.0, 0.1, 1.0, 10.0)
#: Averages that must be there to compare neighbours.
_FEWEST = 20
#: Of a normal distribution: standard deviation over median absolute deviation.
_TO_SIGMA = 1.4826


@dataclass(frozen=True, slots=True)
class _Sensor:
    """Words and scales of a triad: SI to the units of its density and of a sample; the least density that is flagged, in SI."""

    name: str
    noise: str
    columns: slice
    density: tuple[float, str]
    sample: tuple[float, str]
    least: float


_DEG = 180.0 / np.pi
_UG = 9.80665e-6
_SENSORS = (
    _Sensor("gyros", "gyro_noise", slice(0, 3), (_DEG * 60.0, "deg/sqrt(h)"), (_DEG, "deg/s"), 0.3 / _DEG / 60.0),
    _Sensor("accelerometers", "accel_noise", slice(3, 6), (1.0 / _UG, "ug/sqrt(Hz)"), (1e-3 / _UG, "mg"), 1000.0 * _UG),
)


class SensorNoiseConfig(Settings):
    """Compares the noise of the stream ``imu`` with ``gyro_noise`` and ``accel_noise`` of ``sins_static.phi_angle``."""

    kind: Literal["sins_static.sensor_noise"]
    factor: Annotated[float, Field(gt=1.0, description="more than so many times the model's noise is flagged")] = 5.0


@dataclass(frozen=True, slots=True)
class SensorNoiseMonitor:
    """Looks at the stream ``imu`` with the model in hand."""

    name: str
    cfg: SensorNoiseConfig

    def inspect_for(self, record: Record, model: Model) -> Findings:
        """One event for each triad that is noisier than the model has it.

        Raises
        ------
        DataError
            The record has no stream ``imu``.
        """
        if "imu" not in record.streams:
            raise DataError(
                f"monitor {self.name!r} needs the stream 'imu'", hint=f"there are: {', '.join(record.streams)}"
            )
        imu = record.streams["imu"]
        found = white_density(imu)
        configured = {noise.name: np.sqrt(noise.psd) for noise in model.noises}
        sensors = [s for s in _SENSORS if s.noise in configured]
        return Findings(tuple(e for s in sensors for e in self._events(s, imu, found[s.columns], configured[s.noise])))

    def _events(self, sensor: _Sensor, imu: Stream, found: FloatArray, configured: FloatArray) -> list[Event]:
        axis = int(np.argmax(found / np.maximum(configured, 1e-300)))
        if not found[axis] > max(self.cfg.factor * configured[axis], sensor.least):
            return []
        scale, unit = sensor.density
        per_sample, sample_unit = sensor.sample
        sample = found[axis] / np.sqrt(_period(imu)) * per_sample
        text = (
            f"the noise of the {sensor.name} is that of {found[axis] * scale:.3g} {unit} ({sample:.2g} {sample_unit} in each "
            f"sample), the model has {configured[axis] * scale:.3g} {unit}: its sigmas are too small; raise `{sensor.noise}`"
        )
        return [Event(float("nan"), self.name, "noise", text)]


def white_density(imu: Stream) -> FloatArray:
    """The white noise (6,) that the increments can hold at most: rad/sqrt(s) and m/s/sqrt(s).

    Neighbouring sums over a time T differ by sqrt(2 T) times the density. Rows that are not finite do not count; a stream too
    short to tell has zeros.
    """
    period = _period(imu)
    values = imu.values[np.isfinite(imu.values).all(axis=1), :6]
    found = []
    for length in sorted({max(1, round(T / period)) for T in _AVERAGING}):
        count = len(values) // length
        if count < _FEWEST:
            break
        sums = values[: count * length].reshape(count, length, 6).sum(axis=1)
        step = np.diff(sums, axis=0)
        spread = _TO_SIGMA * np.median(np.abs(step - np.median(step, axis=0)), axis=0)
        found.append(spread / np.sqrt(2.0 * length * period))
    return np.min(found, axis=0) if found else np.zeros(6)


def _period(imu: Stream) -> float:
    return imu.period or float(np.median(np.diff(imu.time)))


def sensor_noise(name: str, cfg: SensorNoiseConfig, site: Site | None) -> SensorNoiseMonitor:
    """The monitor; it does not depend on the place."""
    return SensorNoiseMonitor(name, cfg)
