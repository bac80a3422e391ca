"""Generic state blocks: random constant, random walk, first-order Gauss-Markov, integrated random walk."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, Strict, model_validator

from estimfw.config.block_frames import AXES_OF_FRAME
from estimfw.config.generic.values import (
    not_negative,
    numbers_in,
    product_unit,
    refuse_odd_units,
    refuse_too_many_states,
    refuse_twice,
)
from estimfw.config.quantity_types import refuse
from estimfw.config.types import Identifier, Names, Settings, Site
from estimfw.model.coefficient import constant, identity
from estimfw.model.parts import BlockParts, NoiseInput, ProcessTerm, StateBlock

__all__ = [
    "GaussMarkovConfig",
    "IntegratedRandomWalkConfig",
    "RandomConstantConfig",
    "RandomWalkConfig",
    "gauss_markov",
    "integrated_random_walk",
    "random_constant",
    "random_walk",
]

Value = str | float
Values = Annotated[Value | Annotated[tuple[Value, ...], Strict(False)], Field(examples=["0.1 m", ["0.1 m", "0.2 m"]])]


Unit = Annotated[str, Field(description="SI unit of the states, such as m/s^2; 1 is none")]


class _BlockConfig(Settings):
    """A group of states in one unit; in a ``frame`` of other blocks' it is a triad that policies and terms can turn."""

    unit: Unit = "1"
    axes: Annotated[
        Names, Field(description="names of the states (left out: the axes of the frame, else one state)")
    ] = ()
    frame: Annotated[
        Identifier | None, Field(description="frame of the triad, one that another block brings, such as b")
    ] = None
    sigma: Annotated[Values, Field(description="prior standard deviation: one for all, or one for each axis")]
    mean: Annotated[Values | None, Field(description="prior mean (left out: 0)")] = None
    display_unit: Annotated[str, Field(description="unit for people, such as deg/h (left out: the SI unit)")] = ""
    quantity: Annotated[
        str,
        Field(
            description="what it is the error of, such as gyro_bias: a nominal provider that corrects that takes its estimate"
        ),
    ] = ""
    truth: Annotated[
        str,
        Field(
            description="name of the truth that the states should equal, such as gyro_bias_b, where a source knows it"
        ),
    ] = ""
    latex: Annotated[str, Field(description="symbol for equations, such as b_g")] = ""

    @model_validator(mode="after")
    def _numbers(self) -> Self:
        refuse_odd_units(self.unit, self.display_unit)
        refuse_twice(self.axes, "axes")
        if self.frame is not None and len(self.names()) != 3:
            refuse(f"{len(self.axes)} axes in the frame {self.frame!r}", "leave out `axes`: a frame has three", "axes")
        refuse_too_many_states(len(self.names()))
        self.sigmas()
        self.means()
        return self

    def names(self) -> tuple[str, ...]:
        return self.axes or (AXES_OF_FRAME if self.frame is not None else ("",))

    def sigmas(self) -> tuple[float, ...]:
        """SI; a negative one is refused."""
        values = numbers_in(self.sigma, self.unit, len(self.names()), "sigma")
        not_negative(values, self.sigma, "sigma")
        return values

    def means(self) -> tuple[float, ...]:
        n = len(self.names())
        return (0.0,) * n if self.mean is None else numbers_in(self.mean, self.unit, n, "mean")

    def block(self, name: str) -> StateBlock:
        """The block; the axes of its frame are put in later."""
        return StateBlock(
            name, self.names(), self.names(), self.unit, self.display_unit or self.unit, frame=self.frame,
            home_frame=self.frame, quantity=self.quantity, latex=self.latex, truth=self.truth,
        )  # fmt: skip

    def covariance(self) -> tuple[tuple[float, ...], ...]:
        return tuple(tuple(float(x) for x in row) for row in np.diag(np.square(self.sigmas())))


class RandomConstantConfig(_BlockConfig):
    """x' = 0, but for what other terms couple into it."""

    kind: Literal["random_constant"]


class RandomWalkConfig(_BlockConfig):
    """x' = w; ``noise`` is the density of w, such as ``0.01 m/sqrt(s)`` for a block in m."""

    kind: Literal["random_walk"]
    noise: Annotated[Values, Field(description="density of the driving noise, in unit/sqrt(s)")]

    @model_validator(mode="after")
    def _noise(self) -> Self:
        self.density()
        return self

    def density(self) -> tuple[float, ...]:
        """Per axis, unit / sqrt(s)."""
        values = numbers_in(self.noise, product_unit(self.unit, "1/sqrt(s)"), len(self.names()), "noise")
        not_negative(values, self.noise, "noise")
        return values


class GaussMarkovConfig(_BlockConfig):
    """x' = -x / tau + w with steady sigma ``steady_sigma`` (PSD of w 2 sigma^2 / tau); ``sigma`` is the start's."""

    kind: Literal["gauss_markov"]
    correlation_time: Annotated[Values, Field(description="time tau after which 1/e of a value is left")]
    steady_sigma: Annotated[Values, Field(description="standard deviation in the long run, in the unit of the states")]

    @model_validator(mode="after")
    def _dynamics(self) -> Self:
        self.steady()
        if min(self.times()) <= 0.0:
            refuse(f"correlation_time must be positive: {self.correlation_time!r}", "such as 300 s", "correlation_time")
        return self

    def times(self) -> tuple[float, ...]:
        """s, per axis."""
        return numbers_in(self.correlation_time, "s", len(self.names()), "correlation_time")

    def steady(self) -> tuple[float, ...]:
        values = numbers_in(self.steady_sigma, self.unit, len(self.names()), "steady_sigma")
        not_negative(values, self.steady_sigma, "steady_sigma")
        return values


class IntegratedRandomWalkConfig(_BlockConfig):
    """x' = r, r' = w: brings the block ``<name>_rate`` too; ``noise`` is the density of w, such as ``0.1 m/s/sqrt(s)``."""

    kind: Literal["integrated_random_walk"]
    rate_sigma: Annotated[Values, Field(description="prior standard deviation of the rate, in unit/s")]
    rate_mean: Annotated[Values | None, Field(description="prior mean of the rate (left out: 0)")] = None
    noise: Annotated[Values, Field(description="density of the noise that drives the rate, in unit/s/sqrt(s)")]

    @model_validator(mode="after")
    def _rate(self) -> Self:
        self.rates()
        self.density()
        return self

    def rates(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Mean and sigma of the rate, SI."""
        unit, n = product_unit(self.unit, "1/s"), len(self.names())
        mean = (0.0,) * n if self.rate_mean is None else numbers_in(self.rate_mean, unit, n, "rate_mean")
        sigma = numbers_in(self.rate_sigma, unit, n, "rate_sigma")
        not_negative(sigma, self.rate_sigma, "rate_sigma")
        return mean, sigma

    def density(self) -> tuple[float, ...]:
        values = numbers_in(self.noise, product_unit(self.unit, "1/s^1.5"), len(self.names()), "noise")
        not_negative(values, self.noise, "noise")
        return values


def random_constant(name: str, cfg: RandomConstantConfig, site: Site | None) -> BlockParts:
    return BlockParts(cfg.block(name), cfg.covariance(), cfg.means())


def random_walk(name: str, cfg: RandomWalkConfig, site: Site | None) -> BlockParts:
    terms, noise = _driven(cfg.block(name), tuple(q * q for q in cfg.density()))
    return BlockParts(cfg.block(name), cfg.covariance(), cfg.means(), terms=terms, noises=noise)


def gauss_markov(name: str, cfg: GaussMarkovConfig, site: Site | None) -> BlockParts:
    psd = tuple(2.0 * s * s / t for s, t in zip(cfg.steady(), cfg.times(), strict=True))
    terms, noise = _driven(cfg.block(name), psd)
    decay = constant(np.diag([-1.0 / t for t in cfg.times()]))
    own = ProcessTerm(f"{name}.decay", name, name, decay, text="-x / tau, first-order Gauss-Markov")
    return BlockParts(cfg.block(name), cfg.covariance(), cfg.means(), terms=(own, *terms), noises=noise)


def integrated_random_walk(name: str, cfg: IntegratedRandomWalkConfig, site: Site | None) -> tuple[BlockParts, ...]:
    rate = f"{name}_rate"
    mean, sigma = cfg.rates()
    unit = f"{cfg.unit}/s"
    block = StateBlock(rate, cfg.names(), cfg.names(), unit, unit, frame=cfg.frame, home_frame=cfg.frame)
    covariance = tuple(tuple(float(x) for x in row) for row in np.diag(np.square(sigma)))
    terms, noise = _driven(block, tuple(q * q for q in cfg.density()))
    own = ProcessTerm(f"{name}.rate", name, rate, identity(len(cfg.names())), text="x' = rate")
    return (
        BlockParts(cfg.block(name), cfg.covariance(), cfg.means(), terms=(own,)),
        BlockParts(block, covariance, mean, terms=terms, noises=noise),
    )


def _driven(block: StateBlock, psd: tuple[float, ...]) -> tuple[tuple[ProcessTerm, ...], tuple[NoiseInput, ...]]:
    """White noise, the rate of the block, and the term that adds it."""
    rate = f"{block.unit}/s"
    noise = NoiseInput(f"{block.name}.noise", block.all_axes, block.axes, psd, rate, frame=block.frame)
    white = identity(len(block.axes))
    return (ProcessTerm(f"{block.name}.driving_noise", block.name, noise.name, white, text="+w, white"),), (noise,)
