r"""In-motion alignment of a strapdown INS with an odometer. This is the convention sheet of the package.

It keeps that of `estimfw_inertial` (n is East, North, Up; b is right, forward, up; ``C_bn`` takes a vector from b to n;
measured = true + bias), and adds

* ``i``: the body axes at the start, held in inertial space, i = b(0). ``C_bi`` takes a vector from b to i, ``C_ni`` from n to i;
  ``C_bn = C_ni^T C_bi``. Its axes are called x, y, z.
* the attitude error is a rotation vector phi in i, with ``true C_ni = exp([phi x]) C_ni``, rad;
* the speed is that of the point at which the odometer measures, along forward, m/s; it has no other component;
* ``r = C_bi v_b`` is the velocity over ground in axes of i, and over the time t since the start::

      U = int C_bi f_b        S = int r        Q1 = int tau r        Q2 = 1/2 int tau^2 r        M_g = int C_bi

* what is measured is the integral of the specific-force equation, ``alpha = r - r(0) - U``, m/s.

The numbers (1) to (18), (K1) to (K8), (A1) to (A6) in this package are those of its README.
"""

from __future__ import annotations

__all__: list[str] = []
