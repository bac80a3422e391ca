"""The paper's simulated experiment (Zhu and Zhang, Table 2): 7, 10 and 12 states at 1, 5 and 10 deg of misalignment.

Order everywhere: heading (counter-clockwise, the program's yaw), pitch, roll, in deg.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray

from estimfw.cli.compare import command
from estimfw.run.published import read_published

FloatArray = NDArray[np.float64]

FAST = "estimator.kernel=numba"
CASES = [(states, angle) for states in (7, 10, 12) for angle in (1.0, 5.0, 10.0)]

OUTPUTS = ("yaw", "pitch", "roll")
EXAMPLES = Path(__file__).parents[3] / "examples"
TABLE = EXAMPLES / "zhu_zhang_table2.csv"
ANGLES = "[[1 deg, 1 deg, 1 deg], [5 deg, 5 deg, 5 deg], [10 deg, 10 deg, 10 deg]]"
COMMAND = (
    *(str(EXAMPLES / f"static_{states}.yaml") for states in (12, 10, 7)), "--set", "source.noise=false", "--set", FAST,
    "--vary", f"source.misalignment={ANGLES}", "--published", str(TABLE),
)  # fmt: skip

#: Table 2 minus an alignment with the clean settings (noise-free), as the specification prints it. Of the 12 states at
#: 10 deg the paper's value hangs on choices that nobody wrote down.
PAPER_MINUS_CLEAN = {
    (7, 1.0): (0.0107, -0.0006, -0.0023),
    (7, 5.0): (0.0301, 0.0001, -0.0040),
    (7, 10.0): (0.0554, 0.0028, -0.0080),
    (10, 1.0): (0.0121, -0.0005, -0.0007),
    (10, 5.0): (0.0325, 0.0004, -0.0023),
    (10, 10.0): (0.0608, 0.0028, -0.0062),
    (12, 1.0): (0.0121, -0.0005, -0.0007),
    (12, 5.0): (0.0190, -0.0017, -0.0021),
    (12, 10.0): (-0.5316, -0.1250, -0.0847),
}


@pytest.mark.parametrize(("states", "angle"), CASES)
def test_every_epoch_equals_an_independent_implementation(
    states: int, angle: float, ran: Callable[..., Any], naive: Callable[..., Any], misaligned: Callable[..., str]
) -> None:
    # Required: heading 0.002 (12 states 0.003), pitch 0.001, roll 0.002. What is left here is the half step of the
    # velocity, C (dv + dtheta x dv / 2) against C exp(dtheta / 2) dv: w_N w_U dt^2 / 8 = 1.8e-8 deg of tilt, and the
    # heading while it is still unknown, 1e-7 deg.
    done = ran(f"static_{states}", misaligned(angle), "source.noise=false")
    error = np.degrees(done.output_error[:, :3])
    np.testing.assert_allclose(error, naive(states, (angle,) * 3).error, rtol=0.0, atol=2e-7)


@pytest.mark.parametrize("states", [7, 10, 12])
def test_noisy_record_gives_what_an_independent_implementation_makes_of_the_same_increments(
    states: int, ran: Callable[..., Any], naive: Callable[..., Any], misaligned: Callable[..., str]
) -> None:
    done = ran(f"static_{states}", misaligned(5.0), "source.seed=3")
    increments = done.prepared.record.streams["imu"].values
    gravity = float(done.prepared.problem.reference["gravity"])  # 9.796184 is rounded, and V_U sums that up
    reference = naive(states, (5.0,) * 3, increments=increments, gravity=gravity)
    np.testing.assert_allclose(np.degrees(done.output_error[:, :3]), reference.error, rtol=0.0, atol=2e-7)
    scale = done.sigma[-1]
    np.testing.assert_allclose(done.estimate[-1] / scale, reference.estimate[-1] / scale, rtol=1e-7, atol=1e-5)


@pytest.fixture(scope="module")
def table() -> dict[tuple[str, str, str], float]:
    """The example's published figures in deg, by filter, angle and output."""
    return {(p.filter, p.value, p.output): float(np.degrees(p.figure)) for p in read_published(TABLE)}


@pytest.mark.parametrize(("states", "angle"), CASES)
def test_published_table_is_the_printed_differences_on_top_of_an_independent_implementation(
    states: int, angle: float, naive: Callable[..., Any], table: dict[tuple[str, str, str], float]
) -> None:
    ours = naive(states, (angle,) * 3).error[-1]
    paper = [table[f"static_{states}", f"{angle:g} deg", f"attitude.{name}"] for name in OUTPUTS]
    np.testing.assert_allclose(paper - ours, PAPER_MINUS_CLEAN[states, angle], rtol=0.0, atol=6e-5)


@pytest.mark.parametrize(("angle", "arcmin"), [(1.0, 2.75), (5.0, -10.24), (10.0, -61.36)])
def test_published_table_has_the_headings_that_the_paper_sums_up(
    angle: float, arcmin: float, table: dict[tuple[str, str, str], float]
) -> None:
    # Magnitudes: Table 2, that its own text sums up as 2.7', 9.8' and 40.5'; signs: the second-order term -a^2/2.
    assert abs(table["static_7", f"{angle:g} deg", "attitude.yaw"] - arcmin / 60.0) < 2e-4


@pytest.fixture(scope="module")
def regenerated(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """What the command of the README answers, and the folder of its page."""
    folder = tmp_path_factory.mktemp("table2")
    told = CliRunner().invoke(command, [*COMMAND, "--json", "-o", str(folder / "table2.html")], catch_exceptions=False)
    return json.loads(told.stdout), folder


def test_table_2_by_one_command_is_within_its_tolerances(regenerated: tuple[dict[str, Any], Path]) -> None:
    tolerance = dict(zip((f"attitude.{name}" for name in OUTPUTS), (0.07, 0.004, 0.009), strict=True))
    met = 0
    for one in regenerated[0]["values"]:
        fragile = one["filter"] == "static_12" and one["point"] == "10 deg"
        if one["published"] is not None and not fragile:
            assert abs(one["error"] - one["published"]) < tolerance[one["output"]], one
            met += 1
    assert met == 24


def test_honest_sigmas_of_the_7_states_stand_beside_those_that_they_believe(
    regenerated: tuple[dict[str, Any], Path],
) -> None:
    # The specification, section 4: 0.0057 deg level and 0.056 deg heading, against 0.0005 and 0.032 as the filter has them.
    seven = {v["output"]: v for v in regenerated[0]["values"] if v["filter"] == "static_7" and v["point"] == "1 deg"}
    for name, own, honest in (("yaw", 0.032, 0.056), ("pitch", 0.0005, 0.0057), ("roll", 0.0005, 0.0057)):
        assert seven[f"attitude.{name}"]["sigma"] == pytest.approx(own, rel=0.2)
        assert seven[f"attitude.{name}"]["honest"] == pytest.approx(honest, rel=0.08)


def test_figure_1_comes_with_it(regenerated: tuple[dict[str, Any], Path]) -> None:
    pictures = {p.name for p in regenerated[1].glob("*.png")}
    assert pictures >= {f"table2_attitude_{name}.png" for name in OUTPUTS}
    assert (regenerated[1] / "table2.html").stat().st_size > 1_000_000


def test_standard_gravity_in_ug_is_no_matter(
    end_error: Callable[..., FloatArray], misaligned: Callable[..., str]
) -> None:
    # The specification's ug is a millionth of the local g = 9.796184 m/s^2; the program's unit is one of 9.80665 m/s^2.
    local = 9.796184e-4
    settings = [misaligned(1.0), "source.noise=false", FAST]
    biases = f"source.accel_bias={local!r} m/s^2"
    prior = f"blocks.accel_bias.sigma={local!r} m/s^2"
    difference = end_error("static_10", *settings, biases, prior) - end_error("static_10", *settings)
    assert np.all(np.abs(difference) < 1e-5)
    assert np.any(difference != 0.0)
