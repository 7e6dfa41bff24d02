"""A vibration mode of the arm, which trajectories excite."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.spatial import FloatArray

BAND_FREQUENCIES = 61
"""Number of frequencies of a band at which amplitudes are computed: 0.5 % apart with an error of 15 %."""


@dataclass(frozen=True)
class ResidualVibration:
    """A vibration mode of the arm, driven by the acceleration of each joint.

    The certificate reports the amplitude that each motion from rest to rest leaves in the mode.

    Attributes:
        frequency: Natural frequency of the undamped mode, Hz.
        damping: Damping ratio of the mode; 1 is critical.
        frequency_error: Largest relative error of the frequency, in both directions.
        suppress: Whether each motion is shaped so that it leaves at most 5 % of this amplitude. It then takes one
            period longer. False: the certificate only reports the amplitude.
    """

    frequency: float
    damping: float = 0.0
    frequency_error: float = 0.15
    suppress: bool = True

    @property
    def period(self) -> float:
        """The period of the damped vibration, s."""
        return 1.0 / (self.frequency * float(np.sqrt(1.0 - self.damping**2)))

    @property
    def band(self) -> FloatArray:
        """Frequencies (N,) from the lowest to the highest that the mode may have, Hz."""
        low, high = 1.0 - self.frequency_error, 1.0 + self.frequency_error
        return self.frequency * np.linspace(low, high, BAND_FREQUENCIES if self.frequency_error else 1)
