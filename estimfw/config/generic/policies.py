"""The generic policies as config components."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, Strict

from estimfw.config.types import Names, Number, Settings
from estimfw.policies.change import Policy
from estimfw.policies.drop_states import DropStates
from estimfw.policies.drop_term import DropTerm
from estimfw.policies.express_in_frame import ExpressInFrame
from estimfw.policies.fix_nominal import FixNominal
from estimfw.policies.prune_unobservable import MODES, PruneMode, PruneUnobservable

__all__ = [
    "DropStatesConfig",
    "DropTermConfig",
    "ExpressInFrameConfig",
    "FixNominalConfig",
    "PruneUnobservableConfig",
    "drop_states",
    "drop_term",
    "express_in_frame",
    "fix_nominal",
    "prune_unobservable",
]


class DropTermConfig(Settings):
    """Drop process terms by label."""

    kind: Literal["drop_term"]
    terms: Annotated[Names, Field(description="labels of process terms")]


class DropStatesConfig(Settings):
    """Drop states (``velocity_error[U]``) or whole blocks."""

    kind: Literal["drop_states"]
    states: Annotated[Names, Field(description="state labels such as velocity_error[U], or names of blocks")]


class ExpressInFrameConfig(Settings):
    """Express a block in another frame."""

    kind: Literal["express_in_frame"]
    block: Annotated[str, Field(description="name of the block, with all its axes still there")]
    frame: Annotated[str, Field(description="the frame it shall be in")]


class FixNominalConfig(Settings):
    """Hold a nominal variable at numbers (SI) or other scalar variables, row by row."""

    kind: Literal["fix_nominal"]
    variable: Annotated[str, Field(description="of the nominal, such as f_n")]
    values: Annotated[
        tuple[Number | str, ...],
        Strict(False),
        Field(description="its scalars row by row: numbers in SI, or names of scalar variables such as gravity"),
    ]


class PruneUnobservableConfig(Settings):
    """Delete what cannot be determined, or let others stand for it; blocks or states in ``protect`` are never touched."""

    kind: Literal["prune_unobservable"]
    mode: Annotated[PruneMode, Field(description=MODES)] = "delete"
    protect: Annotated[Names, Field(description="blocks or states that stay")] = ()


def drop_term(cfg: DropTermConfig) -> Policy:
    return DropTerm(cfg.terms)


def drop_states(cfg: DropStatesConfig) -> Policy:
    return DropStates(cfg.states)


def express_in_frame(cfg: ExpressInFrameConfig) -> Policy:
    return ExpressInFrame(cfg.block, cfg.frame)


def fix_nominal(cfg: FixNominalConfig) -> Policy:
    return FixNominal(cfg.variable, cfg.values)


def prune_unobservable(cfg: PruneUnobservableConfig) -> Policy:
    return PruneUnobservable(cfg.protect, cfg.mode)
