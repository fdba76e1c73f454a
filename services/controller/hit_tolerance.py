"""Decide whether a played motion met its goal."""

from dataclasses import dataclass

from protocol import messages as m
from robot.conversions import unit_of
from robot.description import RobotConfig
from robot.schema import Tolerance


@dataclass(frozen=True, slots=True)
class HitTolerance:
    """The largest allowed errors at a goal's hit, and the arm."""

    tolerance: Tolerance
    config: RobotConfig

    def miss(self, hit: m.Hit) -> str:
        """Return a sentence about the error that made it a miss, or "". The true state is used if it is known."""
        errors = hit.truth_error or m.Point(positions=hit.position_error, velocities=hit.velocity_error)
        for values, bound, quantity in (
            (errors.positions, self.tolerance.positions, "position"),
            (errors.velocities, self.tolerance.velocities, "velocity"),
        ):
            error, joint = max((abs(value), joint) for joint, value in enumerate(values))
            if error > bound:
                name, unit = self.config.joint_names[joint], unit_of(quantity, self.config.slides[joint])
                return f"{name} was {error:.3g} {unit} off at the hit, more than {bound:g} {unit}"
        return ""


def tolerance_of(trajectory: m.Trajectory, config: RobotConfig) -> HitTolerance:
    """Return the tolerance of a trajectory, by default the robot's."""
    own, asked = config.tolerance, trajectory.tolerance
    if not isinstance(asked, m.Tolerance):
        return HitTolerance(own, config)
    positions = own.positions if asked.positions is None else asked.positions
    velocities = own.velocities if asked.velocities is None else asked.velocities
    return HitTolerance(Tolerance(positions, velocities), config)
