"""One realistic message of every type of the wire contract, and several where fields exclude each other."""

from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import asdict

from protocol import messages as m
from protocol.codec import matrix_bytes

JOINTS = ["joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6"]
HOME = [0.0, 0.52, 0.82, -0.2, 0.0, 0.09]
PREPARE = [-0.14, 0.52, 0.82, 0.1645, 0.0, -0.0353]
HIT = [0.17, 0.47, 0.86, -0.0822, 0.0, 0.1058]
SWING = [1.5, -0.25, 0.5, -2.0, 0.0, 0.125]
STILL = [0.0] * 6
SMALL = [0.0005, -0.00025, 0.000125, 0.0, 0.001, -0.002]
RUN = 1_760_000_000_123_456_789
"""A run's name in real time: Unix ns, more than 53 bits."""

SAMPLES = np.array([PREPARE, HOME, HIT, HIT])
STAMPS = m.Stamps(requested=RUN, planned=RUN + 5_000_000, accepted=RUN + 6_000_000, first_command=RUN + 26_000_000)

COEFFICIENTS = np.zeros((3, 6, m.COEFFICIENTS))
COEFFICIENTS[0, :, 0], COEFFICIENTS[0, :, 3:] = PREPARE, (1000.0, -250.0, 0.5)
COEFFICIENTS[1, :, 0], COEFFICIENTS[2, :, 0] = HOME, HIT

CLEARANCE = m.Clearance(distance=0.0625, body="racket", other="world", time_from_start=0.625)
REPORT = m.Report(
    imitation_rms=[0.25, 0.125, 0.5, 0.75, 0.0, 0.0625],
    deviation=m.Deviation(
        from_demonstration=m.Distance(rms=[0.0625, 0.0, 0.03125, 0.125, 0.0, 0.25], max=[0.125] * 6),
        by_limits=m.Distance(rms=[0.001, 0.0, 0.002, 0.0, 0.0, 0.0], max=[0.004, 0.0, 0.008, 0.0, 0.0, 0.0]),
    ),
    phase=0.625,
    basis_count=50,
    final_error=m.FinalError(positions=[1e-13, 0.0, -2e-13, 0.0, 0.0, 3e-14], velocities=[0.0] * 6),
    extremes=m.Extremes(
        positions=[(-0.14, 0.21)] * 6,
        velocities=[(-2.5, 1.5)] * 6,
        accelerations=[(-41.0, 38.5)] * 6,
        jerks=[(-900.0, 850.0)] * 6,
    ),
    margin=m.Margin(
        positions=[1.79, None, 1.5, 1.25, None, 2.0],
        velocities=[12.5] * 6,
        accelerations=[0.0, 120.0, 250.0, 400.0, 500.0, 480.0],
        jerks=[14100.0] * 6,
    ),
    active=[m.ActiveLimit(joint="joint_1", quantity="accelerations", time_from_start=0.375)],
    certified=True,
    checked="all",
    torque_use=[0.25, 0.75, 0.5, None, 0.125, 0.0],
    clearance=CLEARANCE,
    solve_ms=3.75,
    rounds=2,
    rows=17,
)

TRAJECTORY = m.Trajectory(
    goal_id="forehand-7",
    client_id="shell-1",
    lease=True,
    preempt=False,
    epoch=12,
    joint_names=JOINTS,
    start_time=4.25,
    dt=0.001,
    count=4,
    hit_index=2,
    positions=matrix_bytes(SAMPLES),
    velocities=matrix_bytes(np.outer([0.0, 0.5, 1.0, 0.25], SWING)),
    accelerations=matrix_bytes(np.outer([0.0, 1.5, -1.5, 0.0], SWING)),
    stamps=m.Stamps(requested=RUN, planned=RUN + 5_000_000),
)
PIECES = m.Pieces(breaks=[0.0, 0.002, 0.003, 0.003], coefficients=matrix_bytes(COEFFICIENTS))
MOTION: dict[str, Any] = asdict(TRAJECTORY) | {
    "stamps": STAMPS,
    "pieces": PIECES,
    "tolerance": m.Tolerance(velocities=0.0625),
}

STATUS = m.Status(
    time=4.5,
    mode="tracking",
    epoch=13,
    goal_id="forehand-7",
    time_from_start=0.25,
    reference=m.Point(positions=PREPARE, velocities=SWING),
    feedback=m.Point(positions=HOME, velocities=STILL),
    error=m.Point(positions=SMALL, velocities=SMALL),
    cycle=m.Cycle(
        count=4498, missed=2, on_time_ratio=0.9995, late_us=m.Lateness(p50=61.5, p99=240.0, max=1830.0), refused=1
    ),
    fault="tracking error of joint_1 above 0.3 rad",
)

RESULT = m.Result(
    goal_id="forehand-7",
    outcome="succeeded",
    reason="played to rest",
    hit=m.Hit(
        time=5.05,
        position_error=SMALL,
        velocity_error=SMALL,
        truth_error=m.Point(positions=SMALL, velocities=SMALL),
    ),
    peak_tracking_error=0.0125,
    saturated_ticks=3,
    first_contact=m.FirstContact(body="racket", other="ball", time=5.05),
    recoil=m.Recoil(time=5.051, peak_error=0.14, peak_time=5.083, back_time=5.14, tolerance=0.02),
    stamps=STAMPS,
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

ARM: dict[str, Struct] = {
    "State": m.State(
        run=RUN,
        tick=4500,
        time=4.5,
        positions=PREPARE,
        velocities=SWING,
        torques=[12.5, -40.0, 8.25, 0.5, 0.0, 0.125],
        saturated=[False, True, False, False, False, False],
        brake=True,
        applied_tick=4499,
        truth=m.Point(positions=HOME, velocities=STILL),
        condition="reflex",
        reason="joint_2 met more force than it may",
        held={"finger": 0.03125},
    ),
    "Description": m.Description(
        joint_names=JOINTS,
        home=HOME,
        limits=m.RobotLimits(
            positions=[(-2.0, 2.0), None, (-2.5, 2.5), (-3.0, 3.0), (-2.0, 2.0), None],
            velocities=[15.0, 10.0, 12.0, 20.0, 20.0, None],
            accelerations=[300.0, 200.0, 300.0, 500.0, 500.0, None],
            jerks=[15000.0, 10000.0, 15000.0, 25000.0, 25000.0, None],
            torques=[150.0, 150.0, 100.0, 28.0, 28.0, None],
        ),
        rate_hz=1000.0,
        clock="stepped",
        run=7,
        delay_ticks=1,
        modes=["torque", "position"],
        torques_are="measured",
        ball_rate_hz=125.0,
    ),
    "Guided": m.Guided(condition="guiding"),
    "Recovered": m.Recovered(condition="ready", run=8),
    "Hold": m.Hold(joints={"finger": 0.03125}),
    "Held": m.Held(joints={"finger": 0.03125}, arrival_time=5.25),
    "Step": m.Step(ticks=250),
    "Stepped": m.Stepped(tick=4750, time=4.75),
    "Reset": m.Reset(positions=PREPARE, ball=m.Ball(position=(0.75, 0.0, 1.125), velocity=(-3.0, 0.0, 1.5)), seed=7),
    "ResetDone": m.ResetDone(tick=0, time=0.0, run=7),
    "Disturb-acceleration": m.Disturb(
        kind="acceleration", values=[100.0, 0.0, 0.0, 0.0, 0.0, 0.0], start_time=4.5, duration=0.2
    ),
    "Disturb-noise": m.Disturb(kind="sensor_noise", position_std=0.001, velocity_std=0.01),
    "Disturb-wind": m.Disturb(kind="wind", values=[0.0, 2.0, 0.0]),
    "Disturb-ball": m.Disturb(kind="ball_noise", position_std=0.005, latency_s=0.01, drop_rate=0.0625),
    "Throw": m.Throw(position=(4.0, 0.25, 1.0), velocity=(-6.5, 0.0, 2.5), spin=(0.0, 12.5, 0.0)),
    "Thrown": m.Thrown(time=4.5),
    "Disturb-loss": m.Disturb(kind="loss", stream="command", duration=0.05),
    "Disturbed": m.Disturbed(start_time=4.5),
    "Disturbance": m.Disturbance(
        time=4.5,
        active=[
            m.ActiveDisturbance(kind="acceleration", values=SWING, end_time=4.7),
            m.ActiveDisturbance(kind="sensor_noise", position_std=0.001, velocity_std=0.01),
        ],
    ),
    "Contact-touch": m.Contact(time=5.05, bodies=["racket", "ball"], impulse=0.0625, ball_velocity=None, ended=False),
    "Contact": m.Contact(time=5.05, bodies=["racket", "ball"], impulse=0.375, ball_velocity=[6.5, 0.25, 1.0]),
    "Scene": m.Scene(time=5.04, joints={"finger": [0.04], "block": [0.5, 0.25, 0.125, 1.0, 0.0, 0.0, 0.0]}),
    "BallState": m.BallState(time=5.05, position=[0.75, 0.0, 1.125], velocity=[6.5, 0.25, 1.0]),
    "BallState-seen": m.BallState(
        time=5.05,
        position=[0.75, 0.0, 1.125],
        truth=m.BallTruth(position=[0.75, 0.0, 1.0], velocity=[6.5, 0.25, 1.0], spin=[0.0, 12.5, 0.0]),
    ),
    "StrikeRequest": m.StrikeRequest(
        target=(3.0, 0.5, 0.0), flight_time=0.75, count=20, primitives=["forehand"], revise_hz=40.0, until_s=0.0625
    ),
    "Striking": m.Striking(active=True),
    "Strike": m.Strike(
        ball=3,
        phase="planned",
        time=4.5,
        sight=4.25,
        prediction=m.BallPrediction(
            time=5.05,
            position=(0.25, -0.75, 1.125),
            velocity=(-5.5, 0.0, 0.5),
            spread=(0.0625, 0.03125, 0.0625),
            path=[(4.0, 0.25, 1.0), (0.25, -0.75, 1.125)],
        ),
        racket=m.RacketAim(
            time=5.05,
            position=(0.25, -0.75, 1.125),
            normal=(1.0, 0.0, 0.0),
            velocity=(2.5, 0.0, 0.25),
            outgoing=(4.5, 0.5, 2.0),
            landing=(3.0, 0.5, 0.0),
            error=0.125,
        ),
        goal_id="ball-3",
        revisions=2,
        reason="by forehand",
    ),
    "Strike-landed": m.Strike(
        ball=3,
        phase="landed",
        time=6.0,
        hit=m.BallHit(time=5.05, position=(0.25, -0.75, 1.125), velocity=(4.5, 0.5, 2.0)),
        landing=m.Landing(time=6.0, position=(3.125, 0.5, 0.0), distance=0.125, net=True, out=True),
    ),
    "ErrorBody": m.ErrorBody(
        code="limit",
        message="joint_1 would end at 2.5 rad, but its largest position is 2 rad; choose a goal inside its range",
        detail={"joint": "joint_1", "quantity": "positions", "value": 2.5, "bound": 2.0},
    ),
}

EXAMPLES: dict[str, Struct] = GOALS | LIBRARY | CONTROLLER | ARM
"""Messages by file stem; the part of a stem before the hyphen is the message's type."""
