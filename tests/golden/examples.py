"""One realistic message of every type of the wire contract, and several where fields exclude each other."""

from msgspec import Struct

from protocol import messages as m
from protocol.codec import matrix_bytes
from tests.golden.arm import ARM
from tests.golden.values import (
    CLEARANCE,
    HIT,
    HOME,
    JOINTS,
    MOTION,
    PIECES,
    PREPARE,
    REPORT,
    RESULT,
    RUN,
    SAMPLES,
    SMALL,
    STATUS,
    STILL,
    SWING,
    TRAJECTORY,
)

GOALS: dict[str, Struct] = {
    "Goal": m.Goal(
        primitive="forehand",
        positions=HIT,
        velocities=SWING,
        accelerations=[0.0, None, 1.5, None, -2.5, None],
        duration=0.8,
        goal_id="forehand-7",
        client_id="shell-1",
        lease=True,
        waypoints=[
            m.Waypoint(time_from_start=0.25, positions=[0.1, None, None, None, None, None]),
            m.Waypoint(time_from_start=0.5, velocities=[None, 0.5, None, None, None, None]),
        ],
        limits=m.GoalLimits(
            positions=[(-1.0, 1.5), None, None, None, None, None],
            velocities=[8.0, None, None, None, None, None],
            accelerations=[None, 100.0, None, None, None, None],
            jerks=[None, None, 5000.0, None, None, None],
        ),
        tolerance=m.Tolerance(positions=0.001, velocities=0.0625),
        preempt=False,
    ),
    "Goal-correction": m.Goal(
        primitive="forehand",
        positions=HIT,
        alternatives=[
            m.Alternative(positions=HOME, velocities=STILL, accelerations=[0.0, None, 1.5, None, -2.5, None]),
            m.Alternative(duration=0.375),
            m.Alternative(arrival_time=12.75),
        ],
        revises="forehand-7",
        place_time=0.5,
        follow_through=0.0625,
        checks=m.Checks(torque=False),
    ),
    "Goal-tool": m.Goal(
        primitive="forehand",
        tool=m.ToolGoal(
            position=(0.5, 0.25, 0.75),
            orientation=(1.0, 0.0, 0.0, 0.0),
            velocity=(0.5, 0.0, 0.25),
            angular_velocity=(0.0, 0.5, 0.0),
        ),
        waypoints=[m.Waypoint(time_from_start=0.25, tool=m.ToolGoal(position=(0.5, 0.0, 0.5), axis=(0.0, 0.0, 1.0)))],
    ),
    "Goal-fastest": m.Goal(primitive="forehand", fastest=True, method="gaussian"),
    "Goal-plan-only": m.Goal(
        primitive="forehand",
        positions=HIT,
        arrival_time=12.5,
        start=m.Start(positions=PREPARE, velocities=STILL, accelerations=[None, 0.0, 0.5, None, None, None]),
        rest_fraction=0.125,
        tail="coast",
        method="dmp",
        plan_only=True,
        include_trajectory=True,
    ),
    "GoalReply": m.GoalReply(
        goal_id="forehand-7",
        start_time=4.25,
        duration=0.8,
        total_duration=0.95,
        positions=HIT,
        velocities=SWING,
        alternative=2,
        trajectory=TRAJECTORY,
        report=REPORT,
    ),
    "Trajectory": TRAJECTORY,
    "Trajectory-pieces": m.Trajectory(
        goal_id="forehand-8",
        epoch=13,
        joint_names=JOINTS,
        start_time=4.75,
        dt=0.001,
        count=4,
        hit_index=2,
        pieces=PIECES,
        tolerance=m.Tolerance(positions=0.001),
    ),
    "Accepted": m.Accepted(goal_id="forehand-7", start_time=4.25),
    "Plan": m.Plan(
        **MOTION,
        primitive="forehand",
        revises="forehand-6",
        phase=0.625,
        limits=m.PlanLimits(
            positions=[(-2.0, 2.0), None, (-2.5, 2.5), (-3.0, 3.0), (-2.0, 2.0), None],
            velocities=[8.0, 10.0, 12.0, 20.0, 20.0, None],
            accelerations=[300.0] * 6,
            jerks=[15000.0] * 6,
        ),
        waypoints=[m.Waypoint(time_from_start=0.25, positions=[0.1, None, None, None, None, None])],
        torque_use=REPORT.torque_use,
        clearance=CLEARANCE,
        demonstration=matrix_bytes(SAMPLES[:3]),
    ),
    "Refused": m.Refused(
        goal_id="forehand-8",
        client_id="shell-1",
        primitive="forehand",
        code="late",
        message="arrival_time 4.25 s has passed: the motion can begin at 4.500 s",
        detail={"goal_id": "forehand-8"},
        requested=RUN,
    ),
    "Refused-unread": m.Refused(
        goal_id=None,
        client_id="",
        primitive="",
        code="bad_message",
        message="positions is missing",
        detail={"field": "positions"},
        requested=RUN,
    ),
}

LIBRARY: dict[str, Struct] = {
    "Learn": m.Learn(
        name="wipe",
        positions=[[0.0, 0.5], [0.125, 0.5], [0.25, 0.375]],
        joint_names=["lift", "swing"],
        times=[0.0, 0.0125, 0.025],
        smoothing=m.SavitzkyGolay(window_s=0.2, order=5),
        replace=True,
        spread=[[0.01, 0.02], [0.005, 0.01]],
    ),
    "Learn-matrix": m.Learn(
        name="forehand", positions=matrix_bytes(SAMPLES), joint_count=6, rate=200.0, smoothing="none"
    ),
    "Learned": m.Learned(
        name="wipe",
        duration=0.025,
        basis_count=50,
        fit_rms=[0.5, 0.25],
        noise_estimate=[0.0001, 0.0002],
        smoothing=m.SavitzkyGolay(window_s=0.2, order=5),
        position_rms=[0.0001, 0.0002],
        position_max=[0.0005, 0.001],
        start=m.Point(positions=[0.0, 0.5], velocities=[0.0, 0.0]),
        goal=m.Point(positions=[1.0, 0.25], velocities=[0.5, 0.0]),
        samples=200,
        warnings=["the demonstration ends moving: joint_1 at 0.5 rad/s"],
    ),
    "Primitives": m.Primitives(
        primitives=[
            m.PrimitiveEntry(
                name="forehand",
                joint_count=6,
                duration=1.0,
                samples=1001,
                created=1_760_000_000.5,
                robot="arm",
                joint_names=JOINTS,
            )
        ]
    ),
    "Forget": m.Forget(name="wipe"),
    "Forgotten": m.Forgotten(name="wipe"),
}

CONTROLLER: dict[str, Struct] = {
    "Empty": m.Empty(),
    "ReferenceRequest": m.ReferenceRequest(lead=0.05),
    "Reference": m.Reference(
        time=4.5, epoch=13, positions=PREPARE, velocities=SWING, accelerations=STILL, goal_id="forehand-7"
    ),
    "Cancel": m.Cancel(goal_id="forehand-7"),
    "Canceled": m.Canceled(goal_id="forehand-7", stop_time=4.75),
    "ModeReply": m.ModeReply(mode="holding"),
    "ResultRequest": m.ResultRequest(goal_id="forehand-7"),
    "Result": RESULT,
    "Status": STATUS,
    "Command": m.Command(
        run=RUN,
        tick=4500,
        source="controller",
        accelerations=SWING,
        positions=PREPARE,
        velocities=SMALL,
        goal_id="forehand-7",
        next=m.Point(positions=HOME, velocities=STILL),
        feedforward=SMALL,
    ),
}

EXAMPLES: dict[str, Struct] = GOALS | LIBRARY | CONTROLLER | ARM
"""Messages by file stem; the part of a stem before the hyphen is the message's type."""
