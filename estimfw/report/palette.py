"""Colours that people with any colour vision can tell apart, on white and on near-black.

After Okabe and Ito, "Color Universal Design" (2008); the dark twins are the same hues, lighter.
"""

from __future__ import annotations

__all__ = [
    "BAND",
    "BAND_HONEST",
    "BAND_MOST",
    "BAND_NEARLY_ALL",
    "BAND_SMOOTHED",
    "DARK_TWIN",
    "INK",
    "ROLES",
    "SERIES",
    "SOFT",
]

INK, SOFT = "#1b1f24", "#57606a"

SERIES = ("#0072b2", "#d55e00", "#009e73", "#b0578d", "#e69f00", "#56b4e9")
"""Curves that stand side by side in one panel, in this order."""

BAND = "#0072b22e"
"""A translucent band of +-3 sigma."""

BAND_HONEST = "#e69f0030"
"""The same of the honest sigma."""

BAND_SMOOTHED = "#d55e0038"
"""The same of a smoother."""

BAND_MOST, BAND_NEARLY_ALL = "#009e7333", "#b0578d2e"
"""Translucent bands of 95 % and of 99 %, in the colours of these bounds."""

ROLES = {
    "value": SERIES[0],
    "truth": INK,
    "mean": SERIES[1],
    "smoothed": SERIES[1],
    "recorded": SERIES[3],
    "bound": SERIES[2],
    "bound_outer": SERIES[3],
    "fused": SERIES[0],
    "gated": SERIES[1],
    "late": SERIES[3],
    "missing": SERIES[5],
    "invalid": SERIES[4],
}
"""What a curve stands for, and its colour."""

DARK_TWIN = {
    INK: "#f0f3f6",
    "#0072b2": "#4db2ec",
    "#d55e00": "#ff8a4c",
    "#009e73": "#35c99b",
    "#b0578d": "#e795c4",
    "#e69f00": "#f2b635",
    "#56b4e9": "#9ad4f7",
    BAND: "#4db2ec38",
    BAND_HONEST: "#f2b63538",
    BAND_SMOOTHED: "#ff8a4c42",
    BAND_MOST: "#35c99b3d",
    BAND_NEARLY_ALL: "#e795c438",
}
"""For each colour the one to use on a dark page."""
