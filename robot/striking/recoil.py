"""Whether the recoil of a hit leaves the arm clear of its surroundings.

The impulse p on the ball changes the joint velocities by Δq̇ = −M⁻¹ Jᵀ p. Under the tracking law, critically damped
with ω = α/2, the joints deviate from the reference by Δq̇ t e^(−ω t), which is largest at 1/ω. See docs/striking.md.
"""

import numpy as np

from robot.clearance import Clearance
from robot.striking.arm import Arm
from robot.striking.choice import Choice

FACTOR = 1.2
"""Safety factor of the deviation; the largest measured in 589 hits is 1.12."""
PARTS = np.array([0.25, 0.5, 0.75, 1.0])
"""Parts of the time 1/ω at which the arm is checked."""
CONTINUES_S = 0.03
"""s for which the reference is assumed to continue with the velocities of the hit."""


class Recoil:
    """Recoil of the arm after hits. It owns its MuJoCo data: use one a thread."""

    def __init__(self, arm: Arm) -> None:
        self._arm = arm
        self._clearance = Clearance(arm.config, arm.config.model)
        times = PARTS[:, None] * 2 / arm.config.alpha
        self._continued_s = np.minimum(times, CONTINUES_S)
        self._deviation_s = FACTOR * times * np.exp(-PARTS[:, None])

    def postures(self, choice: Choice) -> np.ndarray:
        """Return postures of the deviating arm, (n, J), rad, up to the largest deviation."""
        impulse = self._arm.ball.mass * (choice.incoming - choice.outgoing)
        jump = self._arm.response(choice.positions, impulse)
        return choice.positions + self._continued_s * choice.velocities + self._deviation_s * jump

    def has_room(self, choice: Choice) -> bool:
        """Return whether the arm keeps the margin of plans during the recoil."""
        clearance, postures = self._clearance, self.postures(choice)
        moved = np.abs(postures - choice.positions).max(axis=0)
        ways = clearance.rates[:, : len(moved)] @ moved
        clearance.place(choice.positions)
        near = [pair for pair, way in enumerate(ways) if clearance.distance(pair) < clearance.margin + way]
        for posture in postures if near else ():
            clearance.place(posture)
            if any(clearance.distance(pair) < clearance.margin for pair in near):
                return False
        return True
