"""The nearest valid word, for error messages."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

__all__ = ["did_you_mean"]


def did_you_mean(word: str, valid: Iterable[str]) -> str:
    """A hint such as ``did you mean 'sigma'? (valid: mean, sigma)``.

    Parameters
    ----------
    word : str
        What was written.
    valid : iterable of str
        What could have been written.
    """
    words = sorted(set(valid))
    near = get_close_matches(word, words, n=3, cutoff=0.6)
    listed = ", ".join(words[:12]) + (", ..." if len(words) > 12 else "")
    known = f"valid: {listed}" if words else "nothing is valid here"
    if not near:
        return known
    return f"did you mean {' or '.join(repr(w) for w in near)}? ({known})"
