"""An odometer that counts pulses of a wheel: scale error, vibration, slip, whole pulses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Odometer", "counted_pulses"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Odometer:
    """What is wrong with it.

    Attributes
    ----------
    pulse : float, m
        Way of one pulse.
    scale_sigma : float
        Of the way, drawn for each drive.
    vibration : float, m/s
        Amplitude at 15 m/s; it grows with the speed, at 8 Hz.
    slips : float, 1/s
        Bursts a second, of 0.3 to 1.5 s and 0.5 to 2 m/s, either way, on a vehicle that moves.
    whole : bool
        Whole pulses are counted; False: parts of a pulse as well.
    """

    pulse: float = 0.04
    scale_sigma: float = 2e-3
    vibration: float = 0.25
    slips: float = 1.0 / 60.0
    whole: bool = True


def counted_pulses(time: FloatArray, speed: FloatArray, odometer: Odometer, rng: np.random.Generator) -> FloatArray:
    """Pulses (N,) since before the start, at instants (N,) s of a vehicle with this speed (N,) m/s."""
    of_scale, of_vibration, of_slip, of_start = rng.spawn(4)
    way = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (speed[1:] + speed[:-1]))])
    way *= 1.0 + odometer.scale_sigma * of_scale.standard_normal()
    angular, phase = 2.0 * np.pi * 8.0, of_vibration.uniform(0.0, 2.0 * np.pi)
    way -= odometer.vibration * speed / 15.0 / angular * np.cos(angular * time + phase)
    way += np.concatenate([[0.0], np.cumsum(np.diff(time) * _slip(time[1:], speed[1:], odometer.slips, of_slip))])
    pulses = way / odometer.pulse + 1.0 + of_start.uniform()
    return np.floor(pulses) if odometer.whole else pulses


def _slip(time: FloatArray, speed: FloatArray, slips: float, rng: np.random.Generator) -> FloatArray:
    """Speed of the wheel over ground (N,) m/s."""
    total = np.zeros(time.size)
    for begin in rng.uniform(time[0], time[-1], rng.poisson(slips * (time[-1] - time[0]))):
        length, size, way = rng.uniform(0.3, 1.5), rng.uniform(0.5, 2.0), rng.choice([-1.0, 1.0])
        total[(time >= begin) & (time < begin + length)] = way * size
    return np.where(speed > 3.0, total, 0.0)
