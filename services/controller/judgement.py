"""Decide whether a played motion met its goal."""

from dataclasses import dataclass

from protocol import messages as m
from robot.description import RobotConfig, Tolerance


@dataclass(frozen=True, slots=True)
class Judge:
    """The largest allowed errors at a goal's hit, and the names of the joints."""

    tolerance: Tolerance
    joint_names: tuple[str, ...]

    def miss(self, hit: m.Hit) -> str:
        """Return a sentence about the error that made it a miss, or "". The true state is used if it is known."""
        errors = hit.truth_error or m.Point(positions=hit.position_error, velocities=hit.velocity_error)
        for values, bound, unit in (
            (errors.positions, self.tolerance.positions, "rad"),
            (errors.velocities, self.tolerance.velocities, "rad/s"),
        ):
            error, joint = max((abs(value), joint) for joint, value in enumerate(values))
            if error > bound:
                return f"{self.joint_names[joint]} was {error:.3g} {unit} off at the hit, more than {bound:g} {unit}"
        return ""


def judge_of(trajectory: m.Trajectory, config: RobotConfig) -> Judge:
    """Return the judge of a goal, with the goal's tolerance or by default the robot's."""
    own, asked = config.tolerance, trajectory.tolerance
    if not isinstance(asked, m.Tolerance):
        return Judge(own, config.joint_names)
    positions = own.positions if asked.positions is None else asked.positions
    velocities = own.velocities if asked.velocities is None else asked.velocities
    return Judge(Tolerance(positions, velocities), config.joint_names)
