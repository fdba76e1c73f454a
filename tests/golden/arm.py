"""Golden messages of the robot side: states, scenes, disturbances, the ball."""

from msgspec import Struct

from protocol import messages as m
from tests.golden.values import HOME, JOINTS, PREPARE, RUN, STILL, SWING

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
        accelerations=[30.0, -15.0, 0.5, 0.0, 0.0, 0.25],
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
