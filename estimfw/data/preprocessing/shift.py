"""A sensor's clock turned into the record's."""

from __future__ import annotations

from dataclasses import dataclass, replace

from estimfw.data.record import FloatArray, Stream

__all__ = ["Clock", "shifted"]


@dataclass(frozen=True, slots=True)
class Clock:
    """How stamps c come from instants t: c = t + latency + offset + drift (t - since).

    Attributes
    ----------
    latency : float, s
        By which a reading is stamped too late.
    offset : float, s
        By which the sensor's clock is ahead at ``since``.
    drift : float, s/s
        By which it gains.
    since : float, s
        On the record's clock.
    """

    latency: float = 0.0
    offset: float = 0.0
    drift: float = 0.0
    since: float = 0.0

    def instants(self, stamps: FloatArray) -> FloatArray:
        """Instants t (N,) s of stamps (N,) s."""
        return (stamps - self.latency - self.offset + self.drift * self.since) / (1.0 + self.drift)


def shifted(stream: Stream, clock: Clock) -> Stream:
    """The stream with stamps on the record's clock."""
    period = stream.period / (1.0 + clock.drift) if stream.period is not None else None
    return replace(stream, time=clock.instants(stream.time), period=period)
