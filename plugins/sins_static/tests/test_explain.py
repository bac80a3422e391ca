"""`estimfw explain`: the labelled model in SI, what each policy did, equivalence, ranks, time invariance; as JSON and LaTeX."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from estimfw.cli.main import main

EXAMPLES = Path(__file__).parents[3] / "examples"
G, WN, WU = 9.796184, 6.045437e-5, 4.077699e-5
"""Gravity and Earth rate at the paper's place, in the digits that the specification gives."""

Explain = Callable[..., Any]


@pytest.fixture
def explained(capsys: pytest.CaptureFixture[str]) -> Explain:
    """``explained("static_7", "a.b=1")``: what ``estimfw explain --json`` prints, parsed."""

    def make(example: str, *overrides: str) -> Any:
        settings = [word for text in overrides for word in ("--set", text)]
        assert main(["explain", "--json", str(EXAMPLES / f"{example}.yaml"), *settings]) == 0
        return json.loads(capsys.readouterr().out)

    return make


@pytest.fixture
def printed(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """``printed("static_7", "--latex")``: what ``estimfw explain`` prints for people."""

    def make(example: str, *words: str) -> str:
        assert main(["explain", str(EXAMPLES / f"{example}.yaml"), *words]) == 0
        return capsys.readouterr().out

    return make


def test_the_seven_states_in_numbers(explained: Explain) -> None:
    told = explained("static_7")
    assert told["states"] == [
        "velocity_error[E]", "velocity_error[N]", "attitude_error[E]", "attitude_error[N]", "attitude_error[U]",
        "gyro_bias[N]", "gyro_bias[U]",
    ]  # fmt: skip
    F = np.zeros((7, 7))
    F[0, 3], F[1, 2] = -G, G
    F[2, 3], F[2, 4], F[3, 2], F[4, 2] = WU, -WN, -WU, WN
    F[3, 5] = F[4, 6] = -1.0
    assert np.allclose(told["F"], F, rtol=3e-7, atol=0.0)
    assert np.array_equal(told["H"], np.eye(2, 7))
    assert told["units"] == ["m/s"] * 2 + ["rad"] * 3 + ["rad/s"] * 2


def test_the_noise_is_G_Q_G_transposed_in_SI(explained: Explain) -> None:
    told = explained("static_7")
    G_matrix, Q = np.array(told["G"]), np.array(told["Q"])
    assert told["noise_inputs"] == [
        "accel_noise[E]", "accel_noise[N]", "gyro_noise[E]", "gyro_noise[N]", "gyro_noise[U]"
    ]  # fmt: skip
    assert np.allclose(np.diag(Q), [(9.80665e-5) ** 2] * 2 + [(2.9089e-7) ** 2] * 3, rtol=2e-4)
    diffusion = G_matrix @ Q @ G_matrix.T
    assert np.allclose(diffusion, np.diag([9.80665e-5**2] * 2 + [2.9089e-7**2] * 3 + [0.0] * 2), rtol=2e-4, atol=0.0)


def test_R_says_of_which_kind_it_is(explained: Explain) -> None:
    each = explained("static_7")
    assert np.allclose(each["R"], 0.01 * np.eye(2), rtol=1e-15)
    assert each["R_kind"] == "per_measurement"
    density = explained("static_7", "measurements.zero_velocity.noise=0.1 m/s/sqrt(Hz)")
    assert np.allclose(density["R"], 0.01 * np.eye(2), rtol=1e-15)
    assert density["R_kind"] == "density"


def test_measurements_of_two_kinds_are_told_one_by_one(explained: Explain) -> None:
    told = explained("tracker", "measurements.speed.noise=0.2 m/s/sqrt(Hz)")
    assert told["R_kind"] == {"fix": "per_measurement", "speed": "density"}
    assert np.array_equal(told["R"], np.diag([9.0, 9.0, 0.2**2]))
    assert told["measurement_rows"] == ["fix[x]", "fix[y]", "speed[x]"]


def test_a_varying_F_stands_at_the_providers_initial_nominal(explained: Explain) -> None:
    """The vehicle at 30 deg yaw, the filter's start misaligned by a degree: F has the misaligned attitude."""
    told = explained("static_12", "initial_attitude.yaw=30 deg", "source.misalignment=[1 deg, 2 deg, 3 deg]")
    truth = Rotation.from_euler("Z", 30.0, degrees=True).as_matrix()
    start = Rotation.from_rotvec(-np.radians([1.0, 2.0, 3.0])).as_matrix() @ truth
    F = np.array(told["F"])
    assert np.allclose(F[0:3, 6:9], start, atol=1e-15)
    assert np.allclose(F[3:6, 9:12], -start, atol=1e-15)


@pytest.mark.parametrize(("example", "rank"), [("static_12", 9), ("static_10", 7), ("static_7", 7)])
def test_ranks(explained: Explain, example: str, rank: int) -> None:
    told = explained(example)
    assert told["rank"] == rank
    assert len(told["unobservable"]) == len(told["states"]) - rank


def test_ranks_along_the_policies(explained: Explain) -> None:
    stages = explained("static_7")["stages"]
    assert [(s["states"], s["rank"]) for s in stages] == [(12, 9)] * 4 + [(10, 7), (7, 7)]


def test_what_cannot_be_seen_is_told_in_names(explained: Explain) -> None:
    """Of the 12 states with biases in n, a_N goes with a tilt about East of -a_N/g, a_E with one about North of a_E/g, and
    eps_E with a heading error of -eps_E/w_N; told for one prior sigma, 100 ug and 0.01 deg/h."""
    tilt, heading = np.degrees(100e-6 * 9.80665 / G), 0.01 / 3600 / WN
    told = explained(
        "static_12", "policies=[sins_static.constant_specific_force, sins_static.remove_coriolis, "
        "sins_static.bias_in_navigation_frame]", "source.misalignment=[0 deg, 0 deg, 0 deg]",
    )  # fmt: skip
    first, second, third = told["unobservable"]
    assert first.startswith("accel_bias[E]")
    assert f"attitude_error[N] {tilt:.3g} deg" in first
    assert second.startswith("accel_bias[N]")
    assert f"attitude_error[E] {-tilt:.3g} deg" in second
    assert third == f"gyro_bias[E] 0.01 deg/h, attitude_error[U] {-heading:.3g} deg"


def test_time_invariance_and_its_reason(explained: Explain) -> None:
    seven, twelve = explained("static_7"), explained("static_12")
    assert seven["time_invariant"] is True
    assert twelve["time_invariant"] is False
    assert "accel_bias_coupling needs C_bn, which is varying" in twelve["reason"]
    assert "gyro_bias_coupling needs C_bn, which is varying" in twelve["reason"]
    measured = explained("static_7", "policies=[]")
    assert "gravity_tilt needs f_n, which is varying" in measured["reason"]


def test_each_policy_says_what_it_removed_and_why(explained: Explain) -> None:
    told = {p["label"].partition(".")[2]: p for p in explained("static_7")["policies"]}
    assert list(told) == [
        "constant_specific_force", "remove_coriolis", "bias_in_navigation_frame", "remove_vertical_channel",
        "prune_unobservable",
    ]  # fmt: skip
    assert [p["kind"] for p in told.values()] == ["approximate", "mirrored", "exact", "exact", "approximate"]
    assert told["remove_coriolis"]["removed_terms"] == ["coriolis"]
    assert told["remove_vertical_channel"]["removed_states"] == ["velocity_error[U]", "accel_bias[U]"]
    assert told["prune_unobservable"]["removed_states"] == ["accel_bias[E]", "accel_bias[N]", "gyro_bias[E]"]
    assert all(p["condition"] and p["number"]["text"] for p in told.values())


def test_the_equivalence_table(explained: Explain) -> None:
    def computed(example: str, *overrides: str) -> dict[str, tuple[bool, str]]:
        return {c["operation"]: (c["computed"], c["status"]) for c in explained(example, *overrides)["equivalence"]}

    off = {"transport_rate": (False, "equivalent"), "position_update": (False, "equivalent")}
    on, gone = (True, "equivalent"), (False, "equivalent")
    assert computed("static_12") == {"coriolis": on, "vertical_channel": on, **off}
    assert computed("static_10") == {"coriolis": on, "vertical_channel": gone, **off}
    assert computed("static_7") == {"coriolis": gone, "vertical_channel": gone, **off}
    mismatch = computed("static_7", "nominal.operations.coriolis=on", "nominal.allow_mismatch=true")
    assert mismatch["coriolis"] == (True, "mismatch")


def test_a_mismatch_is_refused_naming_both_sides(capsys: pytest.CaptureFixture[str]) -> None:
    code = main(["explain", str(EXAMPLES / "static_7.yaml"), "--set", "nominal.operations.coriolis=on"])
    told = " ".join(capsys.readouterr().err.split())
    assert code == 3
    assert "inertial.strapdown computes coriolis, the model does not have the term coriolis" in told
    assert "allow_mismatch" in told


def test_people_are_shown_the_same(printed: Callable[..., str]) -> None:
    text = " ".join(printed("static_7").replace("│", " ").split())
    for words in (
        "7 states", "gyro_bias[N] n 0.01 deg/h", "process terms", "-omega_ie x phi (eq. 5)", "10 ug/sqrt(Hz)",
        "0.001 deg/sqrt(h)", "policies, in order", "equivalence of model and nominal", "the term coriolis",
        "time-invariant: no live coefficient needs a varying nominal variable", "series, Phi to order 2 and Q to order 1",
    ):  # fmt: skip
        assert words in text, words
    assert re.search(r"as configured 12 9 .*remove_vertical_channel 10 7 .*prune_unobservable 7 7", text)


def test_directions_that_cannot_be_seen_are_shown(printed: Callable[..., str]) -> None:
    assert "not determined by the measurements" in printed("static_10")
    assert "not determined by the measurements" not in printed("static_7")


# -- LaTeX -------------------------------------------------------------------------------------------------------------


def test_latex_prints_eq_16(printed: Callable[..., str]) -> None:
    text = printed("static_7", "--latex")
    w = r"[\omega_{ie}^n]"
    for line in (
        r"\dot{\delta V}_{E} &= - g\,\phi_{N} + w_{\mathrm{accel},E} \\",
        r"\dot{\delta V}_{N} &= g\,\phi_{E} + w_{\mathrm{accel},N} \\",
        rf"\dot{{\phi}}_{{E}} &= {w}_{{3}}\,\phi_{{N}} - {w}_{{2}}\,\phi_{{U}} - w_{{\mathrm{{gyro}},E}} \\",
        r"\dot{\varepsilon}_{N} &= 0 \\",
        r"z_{E} &= \delta V_{E} + v \\",
    ):
        assert line in text, line
    assert "coriolis" not in text


def test_latex_prints_each_term_with_its_frame(printed: Callable[..., str]) -> None:
    text = printed("static_12", "--latex")
    assert r"\dot{\delta V}^{n} \mathrel{+}= -2\,[\omega_{ie}^n\times]\,\delta V" in text
    assert r"\dot{\delta V}^{n} \mathrel{+}= [f^n\times]\,\phi" in text
    assert r"\dot{\phi}^{n} \mathrel{+}= -\varepsilon" in text
    assert r"[C_b^n]_{1,2}\,a_{F}" in text


@pytest.mark.parametrize("example", ["static_12", "static_7", "tracker", "thermal"])
def test_latex_is_well_formed(printed: Callable[..., str], example: str) -> None:
    """Braces and environments are balanced, no sign stands before a sign, no underscore outside of maths."""
    text = printed(example, "--latex")
    assert text.count("{") == text.count("}")
    assert text.count(r"\begin{align*}") == text.count(r"\end{align*}") == 3
    assert not re.search(r"[+-]\s*[+-]", text)
    assert not re.search(r"\\(?:mathrm|text)\{[^{}]*_", text)
