"""The framework's own components, by their bare names."""

from __future__ import annotations

from estimfw.config.generic import (
    bank,
    blocks,
    decentralised,
    determination,
    direct,
    estimation,
    kalman,
    log,
    nominal,
    policies,
    process,
    simulate_model,
    unscented,
)
from estimfw.config.generic.preprocessing.components import preprocessing_components
from estimfw.registry.component import Component

__all__ = ["core_components"]


def core_components() -> list[Component]:
    """What a config can name without any plugin."""
    return [
        Component("block", "random_constant", blocks.RandomConstantConfig, blocks.random_constant, "x' = 0"),
        Component("block", "random_walk", blocks.RandomWalkConfig, blocks.random_walk, "x' = w"),
        Component("block", "gauss_markov", blocks.GaussMarkovConfig, blocks.gauss_markov, "x' = -x / tau + w"),
        Component(
            "block", "integrated_random_walk", blocks.IntegratedRandomWalkConfig, blocks.integrated_random_walk,
            "x' = r, r' = w; brings the block <name>_rate",
        ),
        Component("process", "couple", process.CoupleConfig, process.couple, "target' += coefficient @ source"),
        Component("input", "schedule", process.ScheduleConfig, process.schedule, "a known input, constant over steps"),
        Component("input", "measured", process.MeasuredConfig, process.measured, "a known input, the last reading of a stream"),
        Component("measurement", "direct", direct.DirectConfig, direct.direct, "selected states, read from a stream"),
        Component("policy", "drop_term", policies.DropTermConfig, policies.drop_term, "drop process terms by label"),
        Component("policy", "drop_states", policies.DropStatesConfig, policies.drop_states, "drop states or blocks"),
        Component(
            "policy", "express_in_frame", policies.ExpressInFrameConfig, policies.express_in_frame, "change a block's frame"
        ),
        Component("policy", "fix_nominal", policies.FixNominalConfig, policies.fix_nominal, "hold a nominal variable"),
        Component(
            "policy", "prune_unobservable", policies.PruneUnobservableConfig, policies.prune_unobservable,
            "delete what cannot be determined",
        ),
        Component("nominal", "constant", nominal.ConstantNominalConfig, nominal.constant_nominal, "named constants"),
        Component("nominal", "stepped", nominal.SteppedNominalConfig, nominal.stepped_nominal, "named constants by step"),
        Component(
            "source", "simulate_model", simulate_model.SimulateModelConfig, simulate_model.simulate_model,
            "the model itself, simulated",
        ),
        Component("source", "log", log.LogConfig, log.log, "logged measurements: a CSV or NPZ file for each stream"),
        *preprocessing_components(),
        Component("estimator", "kalman", kalman.KalmanConfig, estimation.one_filter, "Kalman filter: UD or Joseph"),
        Component("estimator", "bank", bank.BankConfig, bank.bank, "one filter from several starts, the likeliest reported"),
        Component(
            "estimator", "determination", determination.DeterminationConfig, determination.determination,
            "what the nominal provider computes, without states",
        ),
        Component(
            "estimator", "unscented", unscented.UnscentedConfig, estimation.one_filter,
            "unscented filter: sigma points through the nominal and the measurements",
        ),
        Component(
            "estimator", "decentralised", decentralised.DecentralisedConfig, estimation.one_filter,
            "nodes that each own a part of the states and exchange words: together one filter",
        ),
    ]  # fmt: skip
