"""A coarse alignment as a filter meets it: it finds the start in the first part of a record, by one of the methods."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Record
from estimfw.model.nominal import InitialNominal
from estimfw_inertial.coarse_config import CoarseConfig, identity_start, start_from
from estimfw_inertial.coarse_window import checked_place, window_at_start
from estimfw_inertial.place import Place
from estimfw_inertial.sensor_grade import SensorGrade
from estimfw_inertial.standing_attitude import StandingAttitude

__all__ = ["CoarseAlignment", "Estimate"]

FloatArray = NDArray[np.float64]

#: Time (N,) s, increments (N, 3) rad and (N, 3) m/s, place, grade of the sensors -> the attitude at the end.
Estimate = Callable[[FloatArray, FloatArray, FloatArray, Place, SensorGrade], StandingAttitude]


class CoarseAlignment:
    """Finds the start from the first part of a record.

    Parameters
    ----------
    settings : CoarseConfig
    site : Place or None
    estimate : callable
        The method.
    name : str
        Of the method, for people.

    Raises
    ------
    ConfigError, NumericalError
        No site, or a pole.
    """

    #: A session has no record yet: it must be given what ``find`` found.
    needs_record = True

    def __init__(self, settings: CoarseConfig, site: Place | None, estimate: Estimate, name: str) -> None:
        self._settings, self._place = settings, checked_place(site)
        self._estimate, self._name = estimate, name

    def reference(self) -> InitialNominal:
        return identity_start()

    def find(self, record: Record) -> InitialNominal:
        """The attitude at the end of the window.

        Raises
        ------
        DataError
            A record that does not hold the window, or whose means show no direction.
        """
        window = window_at_start(record, self._settings.duration)
        found = self._estimate(window.time, window.dtheta, window.dvel, self._place, self._settings.grade)
        begin = float(window.time[0]) - window.period
        return start_from(found, f"{self._name} over {window.duration:g} s", begin, self._place)
