"""The settings of the decentralised filter: its nodes, what they own, and how they exchange words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal, Self

from pydantic import Field, Strict, model_validator

from estimfw.config.generic.kalman import RecursionConfig
from estimfw.config.generic.smoother import refuse_kalman_only
from estimfw.config.quantity_types import refuse
from estimfw.config.types import Identifier, Names, Settings, quantity
from estimfw.errors import ConfigError
from estimfw.model.model import Model
from estimfw.plan.plan import Plan
from estimfw.plan.subsystems import cut
from estimfw.spelling import did_you_mean

__all__ = ["DecentralisedConfig", "ExchangeConfig", "NodeConfig", "SilenceConfig", "cut_plan"]


class NodeConfig(Settings):
    """One node: every state and every row of a measurement belongs to exactly one of them."""

    name: Annotated[Identifier, Field(description="name of the node")]
    blocks: Annotated[Names, Field(min_length=1, description="blocks that it owns, or single states: velocity[E]")]
    measurements: Annotated[Names, Field(description="measurements that it owns, or single rows: fix[E]")] = ()


class SilenceConfig(Settings):
    """A time in which a node does not answer: its measurements are missing, the others carry its states on."""

    node: Annotated[str, Field(description="name of the node")]
    begin: Annotated[float, quantity("s"), Field(alias="from", description="from the step that ends here or later")]
    until: Annotated[float, quantity("s"), Field(description="up to the last step that ends before this")]

    @model_validator(mode="after")
    def _forward(self) -> Self:
        if not self.until > self.begin:
            refuse(f"until {self.until:g} s is not after from {self.begin:g} s", None, "until")
        return self


class ExchangeConfig(Settings):
    """How the nodes' words are carried."""

    kind: Annotated[Literal["in_process"], Field(description="all nodes in one process, in lockstep")] = "in_process"
    silent: Annotated[
        tuple[SilenceConfig, ...], Strict(False), Field(description="times in which nodes do not answer, for a trial")
    ] = ()


class DecentralisedConfig(RecursionConfig):
    """Nodes that each own states and measurements, and give together exactly what one filter gives.

    A measurement of which several nodes own rows becomes one for each of them, such as ``fix@north``; gates may name either.
    Measurements are fused in the order of the nodes. ``estimfw partition`` prints a section ``nodes``.
    """

    kind: Annotated[Literal["decentralised"], Field(description="a decentralised filter")]
    nodes: Annotated[
        tuple[NodeConfig, ...],
        Strict(False),
        Field(min_length=1, description="the nodes, in the order of their updates"),
    ]
    cross_covariance: Annotated[
        Literal["exact", "drop", "decoupled"],
        Field(
            description="exact: the global filter; drop: no covariance between nodes is kept; decoupled: nor are Phi and Q "
            "between them, each filter is alone. The result then has the true sigma beside the filter's own"
        ),
    ] = "exact"
    loop: Annotated[
        Literal["open", "closed"], Field(description="closed: each step's estimate corrects the nominal provider")
    ] = "open"
    exchange: Annotated[ExchangeConfig, Field(description="how the nodes' words are carried")] = ExchangeConfig()

    @model_validator(mode="before")
    @classmethod
    def _one_kalman_filter_only(cls, data: Any) -> Any:
        return refuse_kalman_only(data, "a decentralised filter")

    @model_validator(mode="after")
    def _heard(self) -> Self:
        if self.cross_covariance == "decoupled" and self.exchange.silent:
            refuse("nobody hears of a decoupled node: it cannot be silent", "exact or drop", "cross_covariance")
        return self

    @property
    def covariance(self) -> Literal["full"]:
        """The form that goes from one step to the next."""
        return "full"

    @property
    def smoother(self) -> None:
        """There is none."""

    @property
    def kernel(self) -> Literal["numpy"]:
        return "numpy"


def cut_plan(cfg: DecentralisedConfig, model: Model, plan: Plan) -> Plan:
    """The plan with the nodes as subsystems.

    Raises
    ------
    ConfigError
        A state or a row belongs to no node, to two, or is not there; a node that is silent is none; ``drop`` with a row that
        reads states of another node.
    """
    _refuse_unknown_nodes(cfg)
    blocks = _places([(b.name, b.labels) for b in model.blocks])
    rows = _places([(m.name, m.labels) for m in plan.measurements])
    states = _owned([n.blocks for n in cfg.nodes], cfg.nodes, blocks, model.states, "blocks", ("block", "state"))
    labels = [label for m in plan.measurements for label in m.labels]
    read = _owned([n.measurements for n in cfg.nodes], cfg.nodes, rows, labels, "measurements", ("measurement", "row"))
    form = None if cfg.cross_covariance == "exact" else cfg.cross_covariance
    nodes = [(node.name, own, own_rows) for node, own, own_rows in zip(cfg.nodes, states, read, strict=True)]
    made = cut(plan, nodes, form)
    if form == "drop":
        _refuse_distant_rows(made)
    return replace(made, measurements=tuple(replace(m, gate=cfg.gates.get(m.name, m.gate)) for m in made.measurements))


def _places(groups: Sequence[tuple[str, Sequence[str]]]) -> dict[str, tuple[int, ...]]:
    """By the name of a group and by each label in it: the places that it stands for."""
    made: dict[str, tuple[int, ...]] = {}
    at = 0
    for name, labels in groups:
        made |= {label: (at + i,) for i, label in enumerate(labels)}
        made[name] = tuple(range(at, at + len(labels)))
        at += len(labels)
    return made


def _owned(
    wanted: Sequence[Sequence[str]],
    nodes: Sequence[NodeConfig],
    places: Mapping[str, tuple[int, ...]],
    labels: Sequence[str],
    key: str,
    words: tuple[str, str],
) -> list[list[int]]:
    """For each node the places that it owns."""
    owner: dict[int, int] = {}
    for i, names in enumerate(wanted):
        for j, name in enumerate(names):
            if name not in places:
                raise ConfigError(
                    f"there is no {words[0]} or {words[1]} {name!r}",
                    hint=did_you_mean(name, places),
                    within=("nodes", i, key, j),
                )
            for place in places[name]:
                if place in owner:
                    both = nodes[owner[place]].name, nodes[i].name
                    told = f"two nodes, {both[0]} and {both[1]}" if both[0] != both[1] else f"the node {both[0]} twice"
                    raise ConfigError(
                        f"{words[1]} {labels[place]} belongs to {told}",
                        hint=f"each {words[1]} belongs to exactly one node",
                        within=("nodes", i, key, j),
                    )
                owner[place] = i
    missing = [label for place, label in enumerate(labels) if place not in owner]
    if missing:
        raise ConfigError(
            f"no node owns the {words[1]}{'s' if len(missing) > 1 else ''} {', '.join(missing)}",
            hint=f"add {missing[0]} to the {key} of a node",
            within=("nodes",),
        )
    return [sorted(place for place, node in owner.items() if node == i) for i in range(len(nodes))]


def _refuse_unknown_nodes(cfg: DecentralisedConfig) -> None:
    names = [node.name for node in cfg.nodes]
    for i, name in enumerate(names):
        if name in names[:i]:
            raise ConfigError(f"two nodes are called {name!r}", within=("nodes", i, "name"))
    for i, silence in enumerate(cfg.exchange.silent):
        if silence.node not in names:
            raise ConfigError(
                f"there is no node {silence.node!r}",
                hint=did_you_mean(silence.node, names),
                within=("exchange", "silent", i, "node"),
            )


def _refuse_distant_rows(plan: Plan) -> None:
    for node, label, state in _distant_rows(plan):
        raise ConfigError(
            f"{label} of node {node} reads {state}, which another node owns: drop keeps no covariance between the two",
            hint="give the row to the node whose states it reads, or use cross_covariance: exact",
            within=("cross_covariance",),
        )


def _distant_rows(plan: Plan) -> Iterator[tuple[str, str, str]]:
    """(node, row, state) of what rows read of other nodes."""
    for node in plan.subsystems.nodes if plan.subsystems is not None else ():
        for m in (plan.measurements[j] for j in node.measurements):
            for entry, _, _ in m.H.monomials:
                row, state = divmod(entry, m.H.shape[1])
                if state not in node.states:
                    yield node.name, m.labels[row], plan.states[state]
