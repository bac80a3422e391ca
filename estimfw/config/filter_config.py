"""The top level of a config. Components stay raw mappings with a ``kind``: their models belong to whoever brings them."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, Strict

from estimfw.config.health import HealthConfig
from estimfw.config.quantity_types import refuse
from estimfw.config.types import Identifier, Settings, Site

__all__ = ["KIND", "Correlation", "FilterConfig", "PriorConfig"]

#: ``kalman`` is the framework's own, ``inertial.strapdown`` a plugin's.
KIND = re.compile(r"[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)?")


def _kind_is_a_name(value: object) -> None:
    if not isinstance(value, str) or not KIND.fullmatch(value):
        refuse(f"{value!r} is no kind", "a kind is a name such as kalman or inertial.strapdown", "kind")


def _no_bare_word(section: object) -> object:
    """A word alone may be meant as the kind: only policies are written so."""
    if isinstance(section, str):
        word = section if KIND.fullmatch(section) else "kalman"
        refuse(f"{section!r} is no mapping of keys to values", f"a component is written {{kind: {word}}}")
    return section


def _with_kind(section: dict[str, Any]) -> dict[str, Any]:
    if "kind" not in section:
        refuse("the key 'kind' is missing", "it says which component this is, such as kind: kalman")
    _kind_is_a_name(section["kind"])
    return section


def _kind_if_any(section: dict[str, Any]) -> dict[str, Any]:
    if "kind" in section:
        _kind_is_a_name(section["kind"])
    return section


def _policy(section: str | dict[str, Any]) -> str | dict[str, Any]:
    if isinstance(section, dict):
        return _with_kind(section)
    _kind_is_a_name(section)
    return section


Section = Annotated[dict[str, Any], BeforeValidator(_no_bare_word), AfterValidator(_with_kind)]
OptionalKind = Annotated[dict[str, Any], BeforeValidator(_no_bare_word), AfterValidator(_kind_if_any)]
PolicySection = Annotated[str | dict[str, Any], AfterValidator(_policy)]


class Correlation(Settings):
    """Two states of the prior that belong together."""

    between: Annotated[tuple[str, str], Strict(False), Field(description="two state labels, such as tilt[E]")]
    value: Annotated[float, Field(ge=-1.0, le=1.0, description="correlation coefficient")]


class PriorConfig(Settings):
    """What the prior holds besides the sigmas of the blocks."""

    correlations: Annotated[
        tuple[Correlation, ...], Strict(False), Field(description="of pairs of states; independent where none is given")
    ] = ()


class FilterConfig(Settings):
    """A filter, its data and its checks.

    ``blocks``, ``process``, ``inputs``, ``measurements``, ``monitors``, ``aiding`` and ``preprocess`` hold named components,
    each with its ``kind``.
    """

    estimfw: Annotated[Literal[1], Field(description="version of the config language")]
    name: str = Field(default="", max_length=200, description="for people")
    extends: str | None = Field(default=None, description="a config that this one is laid over")
    site: Site | None = Field(default=None, description="place on the Earth")
    nominal: Section | None = Field(default=None, description="what makes the operating point (left out: nothing does)")
    initial_attitude: OptionalKind | None = Field(default=None, description="where the nominal starts: given, or found")
    blocks: dict[Identifier, Section] = Field(default={}, description="groups of states, by name, in their order")
    process: dict[Identifier, Section] = Field(default={}, description="what drives the states, by name")
    inputs: dict[Identifier, Section] = Field(default={}, description="known inputs, by name")
    measurements: dict[Identifier, Section] = Field(default={}, description="what is measured of the states, by name")
    prior: PriorConfig | None = Field(default=None, description="what is known at the start besides the blocks' sigmas")
    policies: Annotated[
        tuple[PolicySection, ...], Strict(False), Field(description="reductions of the model, applied in this order")
    ] = ()
    estimator: Section | None = Field(default=None, description="the algorithm and its settings (left out: kalman)")
    health: HealthConfig | None = Field(
        default=None, description="when rejection and divergence are told, and what is done about them"
    )
    monitors: dict[Identifier, Section] = Field(default={}, description="checks of the record before the run, by name")
    source: Section | None = Field(default=None, description="where the record comes from: a log, or a simulation")
    aiding: dict[Identifier, Section] = Field(default={}, description="further sources, whose streams join the record")
    preprocess: dict[Identifier, Section] = Field(
        default={}, description="what is done to the streams before the filter sees them, by name, in this order"
    )
