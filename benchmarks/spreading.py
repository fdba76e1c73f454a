"""`python -m benchmarks.spreading`: whether planning is faster with half of the joints in another process.

PIQP holds Python's global interpreter lock, so threads cannot share the work. Six joints in one process, and three in
each of two, take turns after every goal, on an idle machine and with a running sim and controller. Times are wall
times.
"""

import multiprocessing
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from typing import Any

import tyro
from rich.console import Console
from rich.table import Table

from benchmarks.cases import Case, draw, forehand, joints_of
from benchmarks.machine import save
from benchmarks.timing import milliseconds
from motion.limits import Limits
from motion.plan import WarmStart, plan
from motion.primitive import Primitive
from motion.request import Boundary, MotionRequest
from services.common.cell import running_cell

SETTLED_S = 2.0
PAUSE_S = 0.02
"""Pause between goals, as at 50 goals a second; both processes sleep."""


def part(request: MotionRequest, joints: slice) -> MotionRequest:
    """Return the request of some joints."""

    def only(boundary: Boundary) -> Boundary:
        return Boundary(boundary.positions[joints], boundary.velocities[joints], boundary.accelerations[joints])

    limits = request.limits
    kept = (limits.positions[joints], limits.velocities[joints], limits.accelerations[joints], limits.jerks[joints])
    return replace(request, start=only(request.start), goal=only(request.goal), limits=Limits(*kept))


def of_joints(warm: WarmStart, joints: slice) -> WarmStart:
    """Return the warm start of some joints."""
    return WarmStart(warm.points, warm.rows[joints])


def work(pipe: Any, primitive: Primitive, warms: list[WarmStart]) -> None:
    """Plan the requests from the pipe, each with the index of its warm start, until None is received.

    Send back the parts of the plan that the other process needs.
    """
    while (asked := pipe.recv()) is not None:
        request, number = asked
        made = plan(primitive, request, warm=warms[number])
        pipe.send((made.trajectory, made.report, made.warm))


@contextmanager
def helper(primitive: Primitive, warms: list[WarmStart]) -> Iterator[Any]:  # a pipe's type depends on the platform
    """Run a process that plans with `primitive`; yield the pipe to it."""
    ours, theirs = multiprocessing.Pipe()
    process = multiprocessing.get_context("spawn").Process(target=work, args=(theirs, primitive, warms), daemon=True)
    process.start()
    yield ours
    ours.send(None)
    process.join()


def compare(primitive: Primitive, cases: list[Case], rounds: int) -> dict[str, dict[str, float]]:
    """Return the milliseconds of a warm plan of all joints in one process, and of its halves in two."""
    count = primitive.joint_count
    first, second = slice(0, count // 2), slice(count // 2, count)
    mine, theirs = joints_of(primitive, first), joints_of(primitive, second)
    warms = [plan(primitive, case.before).warm for case in cases]
    alone, spread = [], []
    with helper(theirs, [of_joints(warm, second) for warm in warms]) as pipe:
        for _ in range(rounds + 1):  # the first round is not counted
            for number, (case, warm) in enumerate(zip(cases, warms, strict=True)):
                time.sleep(PAUSE_S)
                began = time.perf_counter()
                plan(primitive, case.request, warm=warm)
                alone.append(time.perf_counter() - began)
                time.sleep(PAUSE_S)
                began = time.perf_counter()
                pipe.send((part(case.request, second), number))
                plan(mine, part(case.request, first), warm=of_joints(warm, first))
                pipe.recv()
                spread.append(time.perf_counter() - began)
    skipped = len(cases)
    return {"one process": milliseconds(alone[skipped:]), "two processes": milliseconds(spread[skipped:])}


@contextmanager
def running_arm() -> Iterator[None]:
    """Run a sim and a controller in real time."""
    with running_cell(flags={"clock": "realtime"}, names=["sim", "controller"], quiet=True):
        time.sleep(SETTLED_S)
        yield


def main(goals: int = 30, rounds: int = 5, seed: int = 7) -> None:
    """Compare on this many goals of six joints with active limits, each this many times; print and save the times."""
    primitive = forehand()
    cases = draw(primitive, goals, seed)
    found = {}
    for where, beside in (("idle machine", nullcontext()), ("beside sim and controller", running_arm())):
        with beside:
            found[where] = compare(primitive, cases, rounds)
    table = Table("", "", "p50 ms", "p99 ms", title=f"Six joints, warm, {os.cpu_count()} cores")
    for where, row in found.items():
        for name, times in row.items():
            table.add_row(where, name, f"{times['p50_ms']:.2f}", f"{times['p99_ms']:.2f}")
    console = Console()
    console.print(table)
    console.print(f"saved to {save('spreading', found).name}")


if __name__ == "__main__":
    tyro.cli(main)
