r"""Static-base fine alignment of a strapdown INS, and its reductions.

Conventions (those of `estimfw_inertial`, and)
----------------------------------------------
* Computed attitude :math:`\tilde C = (I - [\phi\times]) C_b^n`, finite :math:`\exp(-[\phi\times]) C_b^n`; phi in n, rad.
* :math:`\delta V = V_{mech} - V`, in n, m/s. A base at rest has V = 0, so the mechanized velocity is the measurement.
* measured = true + bias: accelerometer biases in m/s^2, gyro biases in rad/s, in b unless a policy re-frames them.

Error model (12 states; Zhu and Zhang, eq. 2 and 5, with omega_en = 0 and f^n = -g^n)::

    dV'  = [f_n x] phi - 2 [omega_ie_n x] dV + C_bn (a_b + eta_a)
    phi' = -[omega_ie_n x] phi - C_bn (eps_b + eta_e)
    a_b' = 0,  eps_b' = 0
"""

__all__: list[str] = []
