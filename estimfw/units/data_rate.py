"""How fast a link is: ``125 MB/s``, ``1 Gbit/s``, ``10000 words/s``; a word has eight bytes."""

from __future__ import annotations

import math
import re

from estimfw.errors import ConfigError
from estimfw.units.quantity import NUMBER_PATTERN

__all__ = ["WORD_BYTES", "words_per_second"]

#: A float64.
WORD_BYTES = 8

_RATE = re.compile(rf"\s*(?P<number>{NUMBER_PATTERN})\s*(?P<prefix>[kMG]?)(?P<what>B|bit|words?)/s\s*", re.ASCII)
_PREFIX = {"": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}
_WORDS = {"B": 1.0 / WORD_BYTES, "bit": 1.0 / (8.0 * WORD_BYTES), "word": 1.0, "words": 1.0}


def words_per_second(text: str) -> float:
    """Read a data rate; prefixes are powers of 1000.

    Raises
    ------
    ConfigError
        The text is no such thing, or not above zero.
    """
    found = _RATE.fullmatch(text)
    rate = float(found["number"]) * _PREFIX[found["prefix"]] * _WORDS[found["what"]] if found is not None else math.nan
    if not 0.0 < rate < math.inf:
        raise ConfigError(f"{text!r} is no data rate", hint="such as 125 MB/s, 1 Gbit/s, 10000 words/s")
    return rate
