"""What process and measurement components get to see of the model that is being composed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from estimfw.errors import ConfigError
from estimfw.model.parts import KnownInput, NoiseInput, StateBlock
from estimfw.spelling import did_you_mean

__all__ = ["ModelContext"]


@dataclass(frozen=True, slots=True)
class ModelContext:
    """What process and measurement components get to see."""

    site: Any
    blocks: Mapping[str, StateBlock]
    noises: Mapping[str, NoiseInput]
    inputs: Mapping[str, KnownInput]

    def block(self, name: str) -> StateBlock:
        """ConfigError with the nearest names where there is none."""
        if name not in self.blocks:
            raise ConfigError(f"there is no block {name!r}", hint=did_you_mean(name, self.blocks))
        return self.blocks[name]

    @property
    def widths(self) -> dict[str, int]:
        """Number of axes of each block, noise input and known input, by name."""
        blocks = {name: len(block.all_axes) for name, block in self.blocks.items()}
        noises = {name: len(noise.all_axes) for name, noise in self.noises.items()}
        return blocks | noises | {name: len(known.axes) for name, known in self.inputs.items()}

    def width(self, source: str) -> int:
        """Number of axes of a block, a noise input or a known input; ConfigError with the nearest names."""
        widths = self.widths
        if source not in widths:
            raise ConfigError(f"there is no block, noise or input {source!r}", hint=did_you_mean(source, widths))
        return widths[source]
