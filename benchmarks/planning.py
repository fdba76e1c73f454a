"""`python -m benchmarks.planning`: the planner and other solvers and planners, in one run on one machine.

Times are processor times of one thread. On an idle machine they equal wall times; other load affects them less. Every
goal is solved by all solvers in turn, so that all run under the same load. Garbage is collected between goals, as in
the planner.
"""

from collections.abc import Mapping

import tyro
from rich.console import Console
from rich.table import Table

from benchmarks.cases import Case, draw, forehand, joint_of
from benchmarks.comparison import PAPER, compare, relative_errors
from benchmarks.machine import save
from benchmarks.workloads import alternatives, growth, refusals, revisions, six_joints
from motion.primitive import Primitive
from services.common.realtime import freeze_garbage


def of_one_joint(primitives: list[Primitive], goals: int, seed: int) -> list[tuple[int, Case]]:
    """Return goals of one joint, equally many of each joint, with the joint's index."""
    drawn = [draw(primitive, -(-goals // len(primitives)), seed + k) for k, primitive in enumerate(primitives)]
    return [(joint, case) for joint, cases in enumerate(drawn) for case in cases][:goals]


def main(goals: int = 60, beside: int = 200, corrections: int = 100, seed: int = 5) -> None:
    """Compare solvers and measure the planner; print and save the results.

    Args:
        goals: Goals of one joint with active limits.
        beside: Goals for the distance from the optimum.
        corrections: Corrections at each phase.
        seed: Of the random goals.
    """
    primitive = forehand()
    primitives = [joint_of(primitive, joint) for joint in range(primitive.joint_count)]
    cases, whole = of_one_joint(primitives, goals, seed), draw(primitive, max(5, goals // 2), seed)
    freeze_garbage()
    found = {
        "one joint": {name: column.summary() for name, column in compare(primitives, cases).items()},
        "six joints": six_joints(primitive, whole),
        "error over the optimum's": relative_errors(primitives, of_one_joint(primitives, beside, seed + 100)),
        "revisions": revisions(primitive, corrections, seed),
        "refused": refusals(primitive, whole),
        "alternatives": {"256": alternatives(primitive, whole, seed)},
        "growth, cold": growth(max(5, goals // 6)),
    }
    report(found)
    print(f"saved to {save('planning', found).name}")


def report(found: dict[str, dict]) -> None:
    """Print all tables."""
    console, paper = Console(width=120), found["one joint"][PAPER]["p50_ms"]
    table = Table("", "p50 ms", "p99 ms", "× CVXOPT", "worst violation", "imitation error", "solved", title="One joint")
    for name, row in found["one joint"].items():
        numbers = f"{row['p50_ms']:.2f}", f"{row['p99_ms']:.2f}", f"{paper / row['p50_ms']:.1f}"
        solved = f"{row['solved']}/{row['solved'] + row['unsolved']}"
        table.add_row(name, *numbers, f"{row['violation']:.1e}", f"{row['error']:.3f}", solved)
    console.print(table)
    table = Table("", "p50 ms", "p99 ms", "× six times CVXOPT", title="Six joints in one plan")
    for name, row in found["six joints"].items():
        table.add_row(name, f"{row['p50_ms']:.2f}", f"{row['p99_ms']:.2f}", f"{6 * paper / row['p50_ms']:.0f}")
    console.print(table)
    ratio = found["error over the optimum's"]
    console.print("imitation error over that of the paper's optimum: ", end="")
    console.print(f"median {ratio['median']:.4f}, worst {ratio['worst']:.4f} of {ratio['goals']} goals")
    for title in ("revisions", "refused", "alternatives", "growth, cold"):
        console.print(times_table(title, found[title]))


def times_table(title: str, rows: Mapping[str, Mapping]) -> Table:
    """Return a table of times and outcomes."""
    table = Table("", "p50 ms", "p99 ms", "max ms", "outcomes", title=title.capitalize())
    for name, row in rows.items():
        outcomes = ", ".join(f"{count} {outcome}" for outcome, count in sorted(row["outcomes"].items()))
        table.add_row(name, f"{row['p50_ms']:.2f}", f"{row['p99_ms']:.2f}", f"{row['max_ms']:.2f}", outcomes)
    return table


if __name__ == "__main__":
    tyro.cli(main)
