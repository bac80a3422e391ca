"""Data rates are read with their prefixes; nothing else is taken for one."""

from __future__ import annotations

import pytest

from estimfw.errors import ConfigError
from estimfw.units.data_rate import words_per_second


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("125 MB/s", 15.625e6),
        ("1 Gbit/s", 15.625e6),
        ("8 B/s", 1.0),
        ("2e3 words/s", 2000.0),
        ("1 word/s", 1.0),
        ("1kB/s", 125.0),
    ],
)
def test_a_word_has_eight_bytes(text: str, words: float) -> None:
    assert words_per_second(text) == pytest.approx(words)


@pytest.mark.parametrize("text", ["", "125", "125 MB", "125 m/s", "0 B/s", "-1 B/s", "1e999 B/s", "1 TB/s", "nan B/s"])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="no data rate"):
        words_per_second(text)
