"""Convert tool poses to joint positions by inverse kinematics along the path, as a recording for `volley learn`.

Needs no services. Without arguments the shipped arm's racket moves along a circle:

    python examples/tool_poses.py                       # writes circle.npz
    python examples/tool_poses.py POSES.npz my.toml     # times (n,), s; poses (n, 7): x, y, z, m, quaternion w first
    volley learn circle.npz
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from robot.description import RobotConfig, RobotError, load_robot
from robot.inverse_kinematics import InverseKinematics
from robot.kinematics import Kinematics
from robot.shipped import DEFAULT_ROBOT_CONFIG
from robot.tool_target import ToolTarget, Unreachable, rotation_of


def joints_along(targets: Sequence[ToolTarget], robot: RobotConfig) -> np.ndarray:
    """Return joint positions (n, J), rad, at which the tool is at n targets in the world frame.

    The first posture is the one nearest to home. Each later search starts from the posture before, so that the arm
    never jumps to another branch.

    Raises: Unreachable: the first target cannot be reached. ValueError: a later target cannot be reached without a
    jump.
    """
    solver, ranges = InverseKinematics(robot), robot.limits.positions
    found = [solver.postures(targets[0], ranges, [robot.home])[0]]
    for number, target in enumerate(targets[1:], start=1):
        posture = solver.nearby(target, ranges, found[-1])
        if posture is None:
            raise ValueError(f"pose {number} of {len(targets)} cannot be reached from the one before without a jump")
        found.append(posture)
    return np.array(found)


def circle(robot: RobotConfig) -> tuple[np.ndarray, list[ToolTarget]]:
    """Return times (n,), s, and targets on a circle of 10 cm through the tool at home, from rest to rest."""
    times = np.linspace(0.0, 4.0, 201)
    s = times / times[-1]
    angle = 2 * np.pi * s**3 * (10 + s * (6 * s - 15))
    position, rotation = Kinematics(robot).tool_pose(robot.home)
    places = position + 0.05 * np.stack([0 * angle, np.sin(angle), np.cos(angle) - 1], axis=1)
    return times, [ToolTarget(place, rotation) for place in places]


def recorded(file: Path) -> tuple[np.ndarray, list[ToolTarget]]:
    """Return the times, s, and targets in a file; raise ValueError if an array is missing."""
    with np.load(file) as arrays:
        missing = {"times", "poses"} - set(arrays)
        if missing or arrays["poses"].shape != (len(arrays["times"]), 7):
            raise ValueError(f"{file} must have the arrays times (n,) and poses (n, 7)")
        times, poses = arrays["times"], arrays["poses"]
    return times, [ToolTarget(pose[:3], rotation_of(pose[3:])) for pose in poses]


def main() -> None:
    """Convert the poses of a file, or the circle; exit with status 2 on failure."""
    file, config = (Path(sys.argv[1]), sys.argv[2]) if len(sys.argv) == 3 else (None, DEFAULT_ROBOT_CONFIG)
    try:
        robot = load_robot(config)
        times, targets = recorded(file) if file else circle(robot)
        joints = joints_along(targets, robot)
    except (OSError, ValueError, RobotError, Unreachable) as problem:
        print(problem, file=sys.stderr)
        sys.exit(2)
    out = file.with_suffix(".joints.npz") if file else Path("circle.npz")
    np.savez(out, times=times, positions=joints, joint_names=np.array(robot.joint_names))
    step = np.abs(np.diff(joints, axis=0)).max()
    print(f"wrote {out}: {len(joints)} postures, at most {step:.3f} rad from one to the next; next: volley learn {out}")


if __name__ == "__main__":
    main()
