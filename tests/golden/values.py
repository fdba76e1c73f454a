"""Values of the golden messages: joints, samples, and the parts that several messages share."""

from typing import Any

import numpy as np
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
