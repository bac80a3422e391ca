"""The command line as a user meets it: in a folder of their own, with files that they broke.

The number in each test's name (or id) is the row of the table of bad inputs that it claims.
"""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.cli.main import main

FloatArray = NDArray[np.float64]

TRACKER = """\
estimfw: 1
name: constant-velocity tracker
blocks:
  position: {kind: random_constant, unit: m, axes: [x, y], sigma: 50 m}
  velocity: {kind: random_walk, unit: m/s, axes: [x, y], sigma: 5 m/s, noise: 0.3 m/s/sqrt(s)}
process:
  kinematics: {kind: couple, target: position, source: velocity, coefficient: 1}
measurements:
  fix: {kind: direct, of: [{block: position}], noise: 3 m}
estimator: {kind: kalman, gate: 0.999}
source: {kind: simulate_model, duration: 10 s, rate: 2 Hz, seed: 7}
"""
LOGGED = "{kind: log, streams: {fix: {file: fix.csv}}}"
STANDING = """\
estimfw: 1
site: {latitude: 34 deg, longitude: 75 deg, height: 0 m}
nominal: {kind: inertial.strapdown, samples: 1}
initial_attitude: {yaw: 22 deg, pitch: 1 deg, roll: -1 deg}
blocks:
  velocity_error: {kind: sins_static.velocity_error, sigma: 0.1 m/s}
  attitude_error: {kind: sins_static.attitude_error, sigma: [0.5 deg, 0.5 deg, 5 deg]}
process:
  phi_angle: {kind: sins_static.phi_angle, gyro_noise: 0.001 deg/sqrt(h), accel_noise: 10 ug/sqrt(Hz)}
measurements:
  zero_velocity: {kind: sins_static.zero_velocity, noise: 0.1 m/s}
estimator: {kind: kalman, loop: closed}
monitors:
  motion: {kind: sins_static.motion}
source:
  kind: inertial.imu_log
  file: log.csv
  columns: {time: t, gyro: [gx, gy, gz], accel: [ax, ay, az]}
"""


@dataclass(frozen=True)
class Told:
    """What a command came to."""

    code: int
    out: str
    err: str

    def says(self, *parts: str) -> None:
        """Each of these stands in what was told, on either stream."""
        told = self.err + self.out
        for part in parts:
            assert part in told, f"{part!r} is not in:\n{told}"


Command = Callable[..., Told]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def estimfw(capsys: pytest.CaptureFixture[str]) -> Command:
    """Runs the command line; no bad input is a bug of ours, and none shows a traceback of ours."""

    def run(*arguments: str) -> Told:
        capsys.readouterr()
        code = main(arguments)
        told = capsys.readouterr()
        assert "our bug" not in told.err
        assert "estimfw/cli/main.py" not in told.err
        return Told(code, told.out, told.err)

    return run


@pytest.fixture
def check(estimfw: Command, folder: Path) -> Command:
    """``estimfw check`` of a config's text (or bytes), with further arguments."""

    def run(config: str | bytes, *arguments: str, name: str = "filter.yaml", command: str = "check") -> Told:
        (folder / name).write_bytes(config.encode() if isinstance(config, str) else config)
        return estimfw(command, name, *arguments)

    return run


@pytest.fixture
def tracker() -> Callable[..., str]:
    """The tracker's config with pieces of its text replaced: old, new, old, new ..."""

    def text(*pieces: str) -> str:
        made = TRACKER
        for old, new in zip(pieces[::2], pieces[1::2], strict=True):
            assert old in made
            made = made.replace(old, new, 1)
        return made

    return text


@pytest.fixture
def logged(tracker: Callable[..., str]) -> str:
    """The tracker on the user's own log ``fix.csv``."""
    return tracker("{kind: simulate_model, duration: 10 s, rate: 2 Hz, seed: 7}", LOGGED)


@pytest.fixture
def fixes() -> str:
    """That log: a straight line, 20 fixes at 2 Hz."""
    return "time,x,y\n" + "".join(f"{0.5 * k},{k}.5,{2 * k}.5\n" for k in range(1, 21))


@pytest.fixture
def standing() -> str:
    """Config of a standing vehicle on the IMU log ``log.csv``."""
    return STANDING


Index = int | slice | list[int]


@dataclass(frozen=True)
class ImuRows:
    """Rows t (s), increments of the gyros (rad) and of the accelerometers (m/s): (N, 7)."""

    rows: FloatArray
    header: str = "t,gx,gy,gz,ax,ay,az"

    def csv(self, separator: str = ",") -> str:
        lines = [separator.join(repr(float(c)) for c in row) for row in self.rows]
        return "\n".join([self.header.replace(",", separator), *lines]) + "\n"

    def changed(self, where: tuple[Index, Index], change: Callable[[FloatArray], FloatArray]) -> ImuRows:
        """With ``rows[where] = change(rows[where])``."""
        rows = self.rows.copy()
        rows[where] = change(rows[where])
        return replace(self, rows=rows)


@pytest.fixture
def imu() -> ImuRows:
    """A good IMU in a vehicle that stands: 20 s at 10 Hz, latitude 34 deg, nearly level, yaw 22 deg."""
    dt, count, latitude, yaw = 0.1, 200, np.radians(34.0), np.radians(22.0)
    rate, gravity = 7.292115e-5, 9.7965
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    rng = np.random.default_rng(5)
    gyro = turn.T @ np.array([0.0, rate * np.cos(latitude), rate * np.sin(latitude)]) * dt
    force = np.array([0.02, -0.03, gravity]) * dt
    noise = rng.standard_normal((count, 6)) * np.repeat([1e-8, 1e-5], 3)
    return ImuRows(np.column_stack([dt * np.arange(1, count + 1), np.hstack([gyro, force]) + noise]))


@pytest.fixture
def imu_check(check: Command, standing: str, folder: Path) -> Command:
    """Checks the standing vehicle on a log with this content, with further ``--set``."""

    def run(content: str | bytes | None, *settings: str, name: str = "log.csv", command: str = "check") -> Told:
        if content is not None:
            (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
        more = [word for setting in settings for word in ("--set", setting)]
        return check(
            standing, *more, "--set", f"source.file={name}", *(["--json"] if command == "run" else []), command=command
        )

    return run


@pytest.fixture
def fix_check(check: Command, logged: str, folder: Path) -> Command:
    """Checks the tracker on a log ``fix.csv`` with this content."""

    def run(content: str | bytes | None, *settings: str, command: str = "check") -> Told:
        if content is not None:
            (folder / "fix.csv").write_bytes(content.encode() if isinstance(content, str) else content)
        more = [word for setting in settings for word in ("--set", f"source.streams.fix.{setting}")]
        return check(logged, *more, *(["--json"] if command == "run" else []), command=command)

    return run


HEAD = """
import pluggy, numpy as np
from typing import Literal
from estimfw.registry.component import Component
from estimfw.config.types import Settings
from estimfw.data.record import Record, Stream
from estimfw.model.coefficient import identity, scalar
from estimfw.model.nominal import InitialNominal, NominalVariable
from estimfw.model.parts import BlockParts, DerivedVariable, Measurement, MeasurementTerm, Output, ProcessTerm, StateBlock
ESTIMFW_API = 1
hookimpl = pluggy.HookimplMarker("estimfw")
"""
TAIL = """
class Thing(Settings):
    kind: Literal["vendor.thing"]

@hookimpl
def estimfw_components():
    return [Component("{role}", "thing", Thing, build, "")]
"""


@pytest.fixture
def install(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., None]]:
    """Installs the plugin ``vendor``: its distribution lies on ``sys.path`` with an entry point.

    With a ``role``, ``code`` defines ``build`` of the component ``vendor.thing``; without, it is the whole module.
    """
    modules: list[str] = []

    def make(code: str, role: str | None = None, distribution: str = "acme-sensor", version: str = "1.2") -> None:
        there = tmp_path_factory.mktemp("site")
        module = there.name.replace("-", "_") + "_" + distribution.replace("-", "_")
        text = textwrap.dedent(code) if role is None else HEAD + textwrap.dedent(code) + TAIL.replace("{role}", role)
        (there / f"{module}.py").write_text(text)
        info = there / f"{distribution.replace('-', '_')}-{version}.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: {version}\n")
        (info / "entry_points.txt").write_text(f"[estimfw]\nvendor = {module}\n")
        monkeypatch.syspath_prepend(str(there))
        modules.append(module)

    yield make
    for module in modules:
        sys.modules.pop(module, None)
