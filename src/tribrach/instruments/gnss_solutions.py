"""The factor by which formal standard deviations of a static baseline are too small.

The engine takes the epochs for independent. Phase errors are not: multipath and the air along the
sight stay alike for minutes, so that epochs every second tell little more than epochs every few
minutes. With an exponential correlation ``exp(-t/T)`` (El-Rabbany and Kleusberg 2003, J. Surv. Eng.
129) the variance of a mean of n epochs, dt apart, is that of independent ones times

    f^2 = (1 + q)/(1 - q) - 2 q (1 - q^n) / (n (1 - q)^2),   q = exp(-dt/T)

(mean of a first-order autoregressive process). Residual errors of baselines are correlated over
some twenty minutes (the same paper), after which the exponential of T = 300 s has fallen to 2 %;
turbulence of the air alone has 125 to 175 s (Kermarrec and Schön 2014, J. Geod. 88:1061), multipath
more. One hour at 30 s gives f = 4.3, within the 3 to 10 that repeated sessions show. Errors that
stay the same for the whole session (residual troposphere, phase centres and others) are not
in this factor. Where phases of a session show their own correlation it takes the place of this one
(:mod:`tribrach.gnss.phase_noise`).
"""

from __future__ import annotations

import numpy as np

#: correlation time of phase errors [s]
CORRELATION_TIME = 300.0
#: what reports cite for the factor
SOURCE = "exponential correlation of phase errors over 300 s (El-Rabbany and Kleusberg 2003)"


def sigma_factor(interval: float, epochs: int) -> float:
    """Factor on formal sigmas of a mean of epochs each ``interval`` [s], with usual correlation."""
    if epochs < 2 or interval <= 0:
        return 1.0
    q = float(np.exp(-interval / CORRELATION_TIME))
    inflation = (1 + q) / (1 - q) - 2 * q * (1 - q**epochs) / (epochs * (1 - q) ** 2)
    return float(np.sqrt(inflation))
