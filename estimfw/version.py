"""The version of the framework's distribution."""

__all__ = ["__version__"]

__version__ = "0.1.0"
