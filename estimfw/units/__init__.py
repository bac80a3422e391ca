"""The closed unit table: text such as ``0.01 deg/h`` in, SI numbers out.

Conventions
-----------
* Inside the program every number is SI with angles in rad; units are for the border, where people read and write.
* ``g``, ``mg``, ``ug`` are multiples of standard gravity, 9.80665 m/s^2. There is no gram: masses are in ``kg``.
* ``m`` is metre, ``min`` minute, ``h`` hour, ``kn`` knot, ``nmi`` nautical mile, ``Gal`` 0.01 m/s^2.
* The angle is a dimension of its own, so ``1 Hz`` is no angular rate.
* Exponents are exact multiples of one half: ``deg/sqrt(h)``, ``deg/√h`` and ``deg/h^0.5`` are one unit.
* ``%`` and ``ppm`` are plain numbers. The table is closed: a plugin adds no units.

The grammar, in words: a number, then a unit. A unit is names joined by ``*`` (or ``·``) and ``/``, read from left to
right; a name or a parenthesis may have a power (``^2``, ``**2``, ``^-1``, ``^0.5``, ``^(1/2)``, ``²``); ``sqrt(...)``
and ``√`` take a root.
"""

from estimfw.units.display import DisplayUnit, display_unit, si_name
from estimfw.units.quantity import Quantity, parse_quantity
from estimfw.units.unit import Dimension, Scale, Unit
from estimfw.units.unit_text import parse_unit

__all__ = [
    "Dimension",
    "DisplayUnit",
    "Quantity",
    "Scale",
    "Unit",
    "display_unit",
    "parse_quantity",
    "parse_unit",
    "si_name",
]
