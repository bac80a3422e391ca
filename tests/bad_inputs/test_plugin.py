"""Plugins that break (23 to 25): they cost a config nothing that does not use them, and are named where one does."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Check = Callable[..., Any]
Tracker = Callable[..., str]
Install = Callable[..., None]

OWNER = "plugin 'vendor' (acme-sensor 1.2)"


def with_source(tracker: Tracker) -> str:
    return tracker("{kind: simulate_model, duration: 10 s, rate: 2 Hz, seed: 7}", "{kind: vendor.thing}")


def test_23_a_plugin_that_raises_on_import_matters_only_if_it_is_used(
    check: Check, tracker: Tracker, install: Install
) -> None:
    install("import libcompass_that_is_not_there")
    told = check(tracker())
    assert told.code == 0
    told.says("warning: plugin vendor: failed (ModuleNotFoundError: No module named 'libcompass_that_is_not_there')")
    told = check(with_source(tracker))
    assert told.code == 4
    told.says(
        "filter.yaml:11:16: the source kind 'vendor.thing' needs the plugin 'vendor' from acme-sensor 1.2, which is failed"
    )
    told.says("ModuleNotFoundError: No module named 'libcompass_that_is_not_there'")


def test_24_a_plugin_for_another_interface_is_incompatible(check: Check, tracker: Tracker, install: Install) -> None:
    install("ESTIMFW_API = 9")
    told = check(tracker())
    assert told.code == 0
    told.says("warning: plugin vendor: incompatible (it is made for interface 9, this program has 1)")
    told = check(with_source(tracker))
    assert told.code == 4
    told.says("needs the plugin 'vendor' from acme-sensor 1.2, which is incompatible: it is made for interface 9")


def test_24_a_name_that_two_distributions_claim_names_both(check: Check, tracker: Tracker, install: Install) -> None:
    code = "def build(cfg, site, given):\n    return None\n"
    install(code, "source", distribution="acme-sensor")
    install(code, "source", distribution="rival-sensor", version="3.0")
    told = check(tracker())
    assert told.code == 0
    told.says("warning: plugin vendor: incompatible")
    told = check(with_source(tracker))
    assert told.code == 4
    told.says("acme-sensor 1.2", "rival-sensor 3.0", "only one of that name")


SOURCE = "class S:\n    def load(self): return {}\ndef build(cfg, site, given): return S()\n"
FIX = "Stream('fix', {}, {}, ('x', 'y'))"
MEASUREMENT = """
def build(name, cfg, context):
    return Measurement(
        name=name, all_rows=("x", "y"), rows=("x", "y"), unit="m", noise="per_measurement", stream="fix", columns=("x", "y"),
        terms=(MeasurementTerm("position", {}),), covariance={},
    )
"""
GOOD_R = "((1.0, 0.0), (0.0, 1.0))"
BLOCK = "def build(name, cfg, site):\n    return BlockParts(StateBlock(name, ('',), ('',), 'm'), {}, {})\n"


@pytest.mark.parametrize(
    ("code", "says"),
    [
        (SOURCE.replace("{}", "1 / 0"), "load() of source raised ZeroDivisionError: division by zero"),
        (SOURCE.replace("{}", "None"), "source made an object of type NoneType, a Record is due"),
        (
            SOURCE.replace("{}", f"Record({{'fix': {FIX.format('np.arange(5.0)', 'np.zeros((4, 2))')}}})"),
            "source made a stream 'fix' that is none: values (4, 2) for 5 times and 2 columns",
        ),
        (
            SOURCE.replace("{}", f"Record({{'fix': {FIX.format('np.array([1.0, np.nan])', 'np.zeros((2, 2))')}}})"),
            "source made a stream 'fix' that is none: its time holds nan at [1]",
        ),
        ("def build(cfg, site, given): return 3\n", "source is an object of type int without load() or load_for()"),
        ("def build(cfg): return 3\n", "the build of source raised TypeError: build() takes 1 positional argument"),
    ],
    ids=["25-raises", "25-no-record", "25-wrong-shape", "25-nan-time", "25-no-source", "25-wrong-signature"],
)
def test_25_a_source_that_breaks_its_contract_is_named(
    check: Check, tracker: Tracker, install: Install, code: str, says: str
) -> None:
    install(code, "source")
    told = check(with_source(tracker))
    assert told.code == 4
    told.says(f"filter.yaml:11:9: {OWNER}: {says}")


@pytest.mark.parametrize(
    ("code", "says"),
    [
        (MEASUREMENT.format("identity(3)", GOOD_R), "the coefficient of position is 3 x 3, 2 x 2 is due"),
        (MEASUREMENT.format("float('nan') * identity(2)", GOOD_R), "the coefficient of position is not finite"),
        (MEASUREMENT.format("identity(2)", "((1.0,),)"), "its covariance has the shape (1, 1), (2, 2) is due"),
        (
            MEASUREMENT.format("identity(2)", GOOD_R.replace("1.0", "float('nan')", 1)),
            "its covariance holds nan at [0, 0]",
        ),
        ("def build(name, cfg, context): return 'H'\n", "is of type str, Measurement is due"),
    ],
    ids=["25-wrong-H", "25-nan-H", "25-wrong-R", "25-nan-R", "25-no-measurement"],
)
def test_25_a_measurement_that_breaks_its_contract_is_named(
    check: Check, tracker: Tracker, install: Install, code: str, says: str
) -> None:
    install(code, "measurement")
    told = check(tracker("  fix:", "  other: {kind: vendor.thing}\n  fix:"))
    assert told.code == 4
    told.says(f"filter.yaml:9:10: {OWNER}: measurement 'other' ", says)


@pytest.mark.parametrize(
    ("code", "says"),
    [
        (BLOCK.format("((float('nan'),),)", "(0.0,)"), "its covariance holds nan at [0, 0]"),
        (BLOCK.format("((1.0,),)", "(0.0, 0.0)"), "its mean has the shape (2,), (1,) is due"),
        (BLOCK.format("((1.0,),)", "('zero',)"), "its mean is not made of numbers"),
    ],
    ids=["25-nan-prior", "25-wrong-mean", "25-no-numbers"],
)
def test_25_a_block_that_breaks_its_contract_is_named(
    check: Check, tracker: Tracker, install: Install, code: str, says: str
) -> None:
    install(code, "block")
    told = check(tracker("blocks:", "blocks:\n  other: {kind: vendor.thing}"))
    assert told.code == 4
    told.says(f"filter.yaml:4:10: {OWNER}: block 'other' is wrong: {says}")


def test_25_a_monitor_that_breaks_its_contract_is_named(check: Check, tracker: Tracker, install: Install) -> None:
    install("class M:\n    def inspect(self, record): return []\ndef build(name, cfg, site): return M()\n", "monitor")
    told = check(tracker() + "monitors: {look: {kind: vendor.thing}}\n")
    assert told.code == 4
    told.says(f"{OWNER}: monitor 'look' returned an object of type list, Findings are due")


@pytest.mark.parametrize(
    ("code", "says"),
    [
        ("return None", "made an object of type NoneType, a Record is due"),
        ("return record.streams['fix'].absent", "apply() of preprocess 'look' raised AttributeError"),
    ],
    ids=["25-no-record", "25-raises"],
)
def test_25_a_preprocessing_that_breaks_its_contract_is_named(
    check: Check, tracker: Tracker, install: Install, code: str, says: str
) -> None:
    install(f"class M:\n    def apply(self, record): {code}\ndef build(name, cfg, site): return M()\n", "preprocess")
    told = check(tracker() + "preprocess: {look: {kind: vendor.thing}}\n")
    assert told.code == 4
    told.says(OWNER, says)


DERIVED = """
def factor():
    return {}

def build(name, cfg, site):
    return BlockParts(
        StateBlock(name, ("",), ("",), "m"), ((1.0,),), (0.0,),
        terms=(ProcessTerm(f"{{name}}.own", name, name, scalar("factor") * identity(1)),),
        derived=(DerivedVariable("factor", (), (), factor),),
    )
"""


@pytest.mark.parametrize(
    ("value", "says"),
    [("np.nan", "is nan"), ("np.zeros(3)", "has the shape (3,), () is due"), ("1 / 0", "raised ZeroDivisionError")],
    ids=["25-derived-nan", "25-derived-shape", "25-derived-raises"],
)
def test_25_a_derived_variable_that_goes_wrong_is_named(
    check: Check, tracker: Tracker, install: Install, value: str, says: str
) -> None:
    install(DERIVED.format(value), "block")
    told = check(tracker("blocks:", "blocks:\n  other: {kind: vendor.thing}"))
    assert told.code == 4
    told.says("the derived variable 'factor' (", says)


PROVIDER = """
class Bound:
    params, n_state, n_sample, compiled = np.zeros(1), 1, 1, None
    def initial_state(self, initial): return np.zeros(1)
    def initial_row(self, initial): return np.ones(1)
    def samples(self, stream, rows): return np.zeros((len(rows) - 1, 1))
    def step(self, state, sample):
        state = state + 1
        return state, {}, np.ones(1)
    def correct(self, state, delta): return state

class Provider:
    kind, operations, slots, stream, samples_per_step, columns = "vendor.thing", (), (), "fix", 1, ("x", "y")
    def variables(self, computed): return (NominalVariable("one", (), "1", "varying"),)
    def reference(self, initial): return {{"one": np.array(1.0)}}
    def start(self, given, record): return InitialNominal({{}})
    def bind(self, settings): return Bound()

def build(cfg, site): return Provider()
"""


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ("np.array([1.0 if state[0] < 5 else np.nan])", "made the process row at t = 2.5 s, which holds nan at [0]"),
        ("np.ones(2)", "made the process row at t = 0.5 s, which has the shape (2,), (1,) is due"),
        ("1 / (state - 3)[0].item()", "step() of nominal 'vendor.thing' at t = 1.5 s raised ZeroDivisionError"),
    ],
    ids=["25-provider-nan", "25-provider-shape", "25-provider-raises"],
)
def test_25_a_provider_that_goes_wrong_is_named_with_the_epoch(
    check: Check, logged: str, fixes: str, folder: Path, install: Install, row: str, says: str
) -> None:
    code = PROVIDER.format(row if "state - 3" not in row else f"np.ones(1) * ({row})")
    install(code, "nominal")
    (folder / "fix.csv").write_text(fixes)
    config = logged.replace("coefficient: 1", "coefficient: {scalar: one}").replace(
        "blocks:", "nominal: {kind: vendor.thing}\nblocks:"
    )
    told = check(config, "--json", command="run")
    assert told.code == 4
    told.says(OWNER, "vendor.thing", says)
