"""Where on the Earth."""

from __future__ import annotations

from typing import Protocol

__all__ = ["SAY_THE_SITE", "Place"]

#: The hint where no place is given.
SAY_THE_SITE = (
    "say where the vehicle stands: `--set 'site={latitude: ..., longitude: ..., height: ...}'`, such as "
    "{latitude: 48.1 deg, longitude: 11.6 deg, height: 520 m}; south and west are negative"
)


class Place(Protocol):
    """Geodetic latitude (rad), longitude (rad) and height above the ellipsoid (m)."""

    @property
    def latitude(self) -> float: ...
    @property
    def longitude(self) -> float: ...
    @property
    def height(self) -> float: ...
