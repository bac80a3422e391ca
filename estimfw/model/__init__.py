"""The model language.

A model is ``x' = F x + G w + B u`` with ``z = H x + v``; every entry keeps the label of the term that put it there.

Conventions
-----------
* A block is a group of states in one frame; state labels are ``block[axis]``, or ``block`` for a single state.
* SI units inside; display units only for people.
* ``C_bn`` takes a vector from b to n. Coefficients are written for full triads in the frame in which a term acts; rotations
  into the frames of the blocks are inserted, then rows and columns are selected.
* A noise input has a power spectral density (SI^2 s), two-sided; a measurement noise is a covariance per measurement, or a
  density that is divided by the measurement's interval.
"""
