"""Messages of the robot side, from a backend's data."""

from protocol import messages as m
from robot.conversions import finite_or_null, limit_fields
from robot.description import RobotConfig
from services.common.robot_side.backend import Abilities, Observation
from services.common.robot_side.drive import Drive


def state_message(now: Observation, drive: Drive, applied_tick: int) -> m.State:
    """Return the state message; `applied_tick` is the tick of the newest applied command."""
    truth = None
    if now.true_positions is not None and now.true_velocities is not None:
        truth = m.Point(positions=now.true_positions.tolist(), velocities=now.true_velocities.tolist())
    condition, reason = now.condition, now.reason
    if drive.brake and condition == "ready":
        condition, reason = "braking", drive.brake_reason
    return m.State(
        run=drive.run,
        tick=now.tick,
        time=now.time,
        positions=now.positions.tolist(),
        velocities=now.velocities.tolist(),
        torques=now.torques.tolist(),
        saturated=now.saturated.tolist(),
        brake=drive.brake,
        applied_tick=applied_tick,
        truth=truth,
        condition=condition,
        reason=reason,
        held=dict(now.held),
        accelerations=None if drive.accelerations is None else drive.accelerations.tolist(),
    )


def description(config: RobotConfig, abilities: Abilities, clock: m.Clock, run: int) -> m.Description:
    """Return the description message of the robot."""
    return m.Description(
        joint_names=list(config.joint_names),
        home=config.home.tolist(),
        limits=m.RobotLimits(**limit_fields(config.limits), torques=finite_or_null(config.torques)),
        rate_hz=config.rate_hz,
        clock=clock,
        run=run,
        delay_ticks=abilities.delay_ticks,
        modes=list(abilities.modes),
        torques_are=abilities.torques_are,
        ball_rate_hz=config.ball.rate_hz if config.ball else None,
    )
