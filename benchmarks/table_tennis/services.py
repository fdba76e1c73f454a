"""`python -m benchmarks.table_tennis.services`: the same balls, returned through the running services over Zenoh."""

import contextlib
import logging
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue

import numpy as np
import tyro

from benchmarks.table_tennis.balls import HEADING, Ball, row
from benchmarks.table_tennis.cell import EnvironmentArm, TableLoop, write_robot
from benchmarks.table_tennis.checks import ArmCheck, command_violations, largest
from benchmarks.table_tennis.demonstrations import learned, quintic_of, still
from benchmarks.table_tennis.exit_status import exit_status_of
from benchmarks.table_tennis.resuming import ResumableRun, scratch_folder
from benchmarks.table_tennis.scene import CONTROL_S, TABLE, robot
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import decode
from protocol.errors import NoAnswer, Refusal
from robot.description import RobotConfig, load_robot
from services.common.cli import Options, free_endpoint, open_bus
from services.common.supervisor import Supervisor, command_lines
from services.planner.library import Arm, Library

WAIT_TICKS = 110
"""Ticks for which the arm rests before each ball: the striker detects the new run and goes to its ready pose."""
LONGEST_TICKS = 360
NAMES = ("planner", "striker", "controller")


@dataclass(frozen=True)
class Arguments:
    """The balls of `python -m benchmarks.table_tennis`, through striker, planner and controller as processes.

    The environment is the robot: its arm follows the controller's commands at 125 Hz, its ball is published as `ball`.
    balls, seed, json, demonstration: as there. noise: m, of each sight. table: relative error of the table's assumed
    restitution. revise_hz: corrections a second, 0: planned once. flight: s from the hit to the landing, by default the
    striker's choice. slow: wall time over robot time while a ball flies, so that the outcome does not depend on the
    machine; 1: real time. verbose: show the logs of the services.
    """

    balls: int = 100
    seed: int = 0
    noise: float = 0.0
    table: float = 0.0
    revise_hz: float = 50.0
    flight: float | None = None
    slow: float = 4.0
    json: Path | None = None
    demonstration: Path | None = None
    verbose: bool = False

    @property
    def name(self) -> str:
        """Name of these conditions."""
        return f"services-{1e3 * self.noise:g}mm-{100 * self.table:+g}%-{self.revise_hz:g}Hz-{self.slow:g}x"


def prepare(folder: Path, arguments: Arguments) -> Path:
    """Write the robot and a library with a strike and the return; return the robot's TOML."""
    arm = robot(folder)
    strike = learned(arguments.demonstration) if arguments.demonstration else quintic_of(arm, folder)
    path = write_robot(folder, 1 + arguments.table)
    for old in (folder / "library").glob("*.npz"):
        old.unlink()
    (folder / "learned.json").unlink(missing_ok=True)
    primitives = Library(folder / "library", Arm(arm.name, arm.joint_names), logging.getLogger())
    primitives.put("strike", strike)
    primitives.put("ready", still(arm.home))
    return path


@contextlib.contextmanager
def running(path: Path, folder: Path, config: RobotConfig, arguments: Arguments) -> Iterator["Table"]:
    """Start the services on a router in this process, and wait until they are ready."""
    endpoint = free_endpoint()
    log = logging.getLogger("table")
    arm = EnvironmentArm(config)
    options = Options(robot_config=path, connect=(endpoint,))
    flags = {"library": folder / "library", "learned": folder / "learned.json"}
    with open_bus(Options(robot_config=path, listen=(endpoint,)), config.name) as bus:
        loop = TableLoop(bus, config, arm, log, arguments.slow)
        loop.open()
        with Supervisor(command_lines(options, flags, NAMES), None if arguments.verbose else folder) as services:
            ready = threading.Thread(target=services.wait_ready, args=(bus,), daemon=True)
            ready.start()
            while ready.is_alive():
                loop.turn()
            services.check_running()
            yield Table(bus, loop, arguments)


class Table:
    """Plays balls on running services."""

    def __init__(self, bus: Bus, loop: TableLoop, arguments: Arguments) -> None:
        self._bus, self.loop, self._arguments = bus, loop, arguments
        self._check = ArmCheck(loop.arm.env, loop.config.limits)
        self._said: SimpleQueue[bytes] = SimpleQueue()
        bus.listen(topics.STRIKES, self._said.put)

    def play(self, seed: int) -> Ball:
        """Play the ball of a seed.

        Raises:
            Refusal, NoAnswer: the striker does not accept the order.
        """
        loop, arguments = self.loop, self._arguments
        rng = np.random.default_rng(seed)
        loop.begin_ball(seed)
        self._check.begin()
        x, y = loop.arm.target.tolist()
        self._order(m.StrikeRequest(target=(x, y, TABLE), flight_time=arguments.flight, revise_hz=arguments.revise_hz))
        for _ in range(WAIT_TICKS):
            loop.turn()
        _drain(self._said)
        loop.commanded.clear()
        released = loop.arm.observe().time
        loop.arm.flies = True
        for _ in range(LONGEST_TICKS):
            loop.turn(arguments.noise * rng.normal(size=3))
            if loop.arm.done:
                break
        return self._judge(released)

    def _order(self, request: m.StrikeRequest) -> None:
        """Order a strike while time advances."""
        failed: list[Exception] = []

        def ask() -> None:
            try:
                self._bus.ask(topics.STRIKE, request)
            except (Refusal, NoAnswer) as error:
                failed.append(error)

        asking = threading.Thread(target=ask, daemon=True)
        asking.start()
        while asking.is_alive():
            self.loop.turn()
        if failed:
            raise failed[0]

    def _judge(self, released: float) -> Ball:
        info = self.loop.arm.info
        said = [decode(body, m.Strike) for body in _drain(self._said)]
        planned = [strike for strike in said if strike.phase in ("planned", "revised")]
        refused = [strike for strike in said if strike.phase == "refused"]
        ball = Ball(
            planned=bool(planned),
            hit=bool(info["hit_ball"]),
            returned=bool(info["ball_returned_success"]),
            success=bool(info["is_success"]),
            error=float(info["land_dist_error"]) if info["ball_returned_success"] else None,
            corrections=sum(strike.phase == "revised" for strike in said),
            refused=len(refused),
            note=refused[-1].reason if refused else "",
        )
        aim = planned[-1].racket if planned else None
        _, positions = self._check.judge(ball, aim.time - released if aim else np.inf)
        commands = [decode(body, m.Command) for body in self.loop.commanded]
        ball.violations = command_violations(self.loop.config.limits, commands, CONTROL_S)
        ticks = positions[:: self._check.steps(CONTROL_S)]
        commanded = np.array([command.positions for command in commands[: len(ticks)]])
        ball.off_plan = largest(np.abs(ticks[: len(commanded)] - commanded))
        return ball


def _drain(queue: SimpleQueue[bytes]) -> list[bytes]:
    found: list[bytes] = []
    with contextlib.suppress(Empty):
        while True:
            found.append(queue.get_nowait())
    return found


def play(arguments: Arguments) -> None:
    """Play the remaining balls, and print the row of all balls."""
    folder = scratch_folder("services")
    resumed = ResumableRun(arguments.name, range(arguments.seed, arguments.seed + arguments.balls), arguments.json)
    if resumed.remaining:
        path = prepare(folder, arguments)
        with running(path, folder, load_robot(path), arguments) as table:
            for _ in resumed.play(table.play):
                pass
            print(f"ticks late by {table.loop.behind_s:.2f} s of wall time in total", file=sys.stderr)
    print(HEADING)
    print(row(arguments.name, list(resumed.balls.values())))


if __name__ == "__main__":
    flags = tyro.cli(Arguments)
    sys.exit(exit_status_of(lambda: play(flags)))
