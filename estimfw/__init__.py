"""estimfw: a Kalman estimation framework in which a filter is data."""

__version__ = "0.1.0"
