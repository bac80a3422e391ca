"""The parts that every field needs, as config components without a plugin.

Blocks: ``random_constant``, ``random_walk``, ``gauss_markov``, ``integrated_random_walk``. Process: ``couple``. Measurement:
``direct``. Inputs: ``schedule``, ``measured``. Policies: ``drop_term``, ``drop_states``, ``express_in_frame``, ``fix_nominal``,
``prune_unobservable``. Nominal: ``constant``. Sources: ``simulate_model``, ``log``. Estimators: ``kalman``,
``unscented``, ``bank``, ``determination``.
"""
