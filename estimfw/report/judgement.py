"""What a result says about its own honesty: whether NIS agrees with the sigmas, and what the sigmas leave out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from estimfw.analysis.chi_square import quantile
from estimfw.report.numbers import UNKNOWN, plain, significant
from estimfw.run.summary import MeasurementSummary, json_attribute

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Verdict", "nis_verdict", "sigma_caveat"]


@dataclass(frozen=True, slots=True)
class Verdict:
    """A few words for a table, their tone (``good``, ``warn``, ``bad`` or empty), and a sentence that explains them."""

    text: str
    tone: str = ""
    sentence: str = ""


def nis_verdict(one: MeasurementSummary) -> Verdict:
    """The mean NIS against the two-sided 99 % bounds of chi-square for all fused epochs together."""
    fused = one.counts["fused"]
    if not fused or not math.isfinite(one.nis_mean) or not one.freedom > 0:
        return Verdict(UNKNOWN)
    degrees = one.freedom * fused
    low, high = (float(quantile(level, [degrees])[0]) / fused for level in (0.005, 0.995))
    told = f"The mean NIS is {significant(one.nis_mean, 3)} where {plain(one.freedom)} is expected: innovations are"
    ratio = math.sqrt(one.nis_mean / one.freedom)
    if one.nis_mean > high:
        more = f"{told} {ratio:.3g} times as large as the filter expects. Its sigmas are too small."
        return Verdict("too large: sigmas too small", "bad", more)
    if one.nis_mean < low:
        size = f"{1 / ratio:.3g} times smaller than the filter expects" if ratio else "zero"
        more = (
            f"{told} {size}. The measurement noise R is set larger than the innovations show, as is usual on a base that "
            f"stands quite still. That says nothing of biases, nor of the other sigmas."
        )
        return Verdict("R larger than the innovations show", "", more)
    return Verdict("consistent", "good", f"{told} as large as the filter expects.")


def sigma_caveat(dataset: xr.Dataset) -> str:
    """One line where the model was reduced, on which of its sigmas to go by; else empty."""
    if "honest_sigma" in dataset:
        return _honest_line(dataset)
    policies = [one for one in json_attribute(dataset, "policies", []) if one.get("kind") == "approximate"]
    if not policies:
        return ""
    names = " and ".join(str(one.get("label", "")) for one in policies)
    removed = ", ".join(str(state) for one in policies for state in one.get("removed_states") or [])
    without = f", and the removed states ({removed}) are not in them" if removed else ""
    verb = "approximates" if len(policies) == 1 else "approximate"
    return f"The sigmas are the reduced filter's own: {names} {verb} the model{without}."


def _honest_line(dataset: xr.Dataset) -> str:
    stages = json_attribute(dataset, "stages", [])
    if any(one.get("held") for one in stages):
        return (
            "The honest sigmas are those of the errors on the whole model, through all stages; the filter's own do not know how "
            "wrong what a stage holds may be."
        )
    rough = any(one.get("kind") == "approximate" for one in json_attribute(dataset, "policies", []))
    form = (json_attribute(dataset, "exchange", None) or {}).get("cross_covariance", "exact")
    if form != "exact":
        more = ", on the unreduced model" if rough else ""
        told = f"The honest sigmas are those of the errors{more}; the nodes' own do not know"
        return f"{told} what cross_covariance: {form} neglects."
    if not rough and not any(one.get("status") == "mismatch" for one in json_attribute(dataset, "equivalence", [])):
        if stages:
            return "No stage holds anything: the honest sigmas, on the whole model, are the filter's own."
        return "The reduction is exact: the honest sigmas, on the unreduced model, are the filter's own."
    truth = json_attribute(dataset, "truth_model", {})
    removed = ", ".join(str(state) for state in truth.get("removed_states") or [])
    told = "The honest sigmas are those of the errors on the unreduced model"
    told += f", in which the removed states ({removed}) live on" if removed else ""
    told += "; the reduced filter's own sigmas do not know what it left out."
    lost = ", ".join(str(name) for name in truth.get("unmodelled") or [])
    return told + (f" Not even the unreduced model has what mirrors {lost}: that is in neither." if lost else "")
