"""Where on the Earth."""

from __future__ import annotations

from typing import Protocol

__all__ = ["Place"]


class Place(Protocol):
    """Geodetic latitude (rad), longitude (rad) and height above the ellipsoid (m)."""

    @property
    def latitude(self) -> float: ...
    @property
    def longitude(self) -> float: ...
    @property
    def height(self) -> float: ...
