r"""Acme's GNSS compass: the baseline between two antennas.

Conventions
-----------
* The baseline points from antenna 1 to antenna 2. In the body frame b (Right, Forward, Up) it is known, ``antennas``, in m.
* A reading is the baseline in n (East, North, Up), in m, at its time stamp in s.
* :math:`\phi` is the attitude error of `estimfw_sins_static`: computed :math:`\tilde C = (I - [\phi\times]) C_b^n`.
"""

__all__: list[str] = []
