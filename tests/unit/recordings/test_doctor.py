"""The doctor finds each fault in faulty recordings and none in clean ones; `experiments.doctor` measures the rates."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.doctor.__main__ import false_alarms, measure
from experiments.doctor.clean import shipped, synthetic
from experiments.doctor.mutations import MUTATIONS, Mutation
from motion.limits import Limits
from tools.recordings.doctor import Arm, Examination, examine
from tools.recordings.preview import preview
from tools.recordings.recording import Recording, Unit

FILES = 4
ARM = Arm(("shoulder", "elbow"), Limits(np.array([[-3.0, 3.0]] * 2), *np.full((3, 2), [[10.0], [100.0], [1e4]])))


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.words)
def test_a_fault_is_found(mutation: Mutation) -> None:
    caught, _ = measure(mutation, FILES, seed=5)
    assert caught == FILES


def test_clean_recordings_have_no_findings() -> None:
    assert false_alarms(seed=5, count=12) == []


def recording(values: np.ndarray, rate: float = 100.0, unit: Unit | None = None) -> Recording:
    times = np.arange(len(values)) / rate
    return Recording(times, ARM.joint_names, values, unit, Path("swing.csv"), "swing", True)


def swing(count: int = 201) -> np.ndarray:
    s = np.linspace(0, 1, count)[:, None]
    return np.array([0.8, -1.2]) * s**3 * (10 + s * (6 * s - 15))


def sentences(examination: Examination) -> str:
    return " ".join(finding.sentence for finding in examination.findings)


def test_a_clean_recording_is_returned_unchanged() -> None:
    examination = examine(recording(swing()), ARM)
    assert not examination.findings
    assert np.array_equal(examination.recording.values, swing())
    assert examination.recording.unit == "rad"


def test_values_declared_as_rad_are_not_converted() -> None:
    examination = examine(recording(np.degrees(swing()), unit="rad"), ARM)
    assert "--unit deg" in sentences(examination)
    assert np.array_equal(examination.recording.values, np.degrees(swing()))


def test_values_declared_as_degrees_are_converted_without_a_finding() -> None:
    examination = examine(recording(np.degrees(swing()), unit="deg"), ARM)
    assert not examination.findings
    assert np.allclose(examination.recording.values, swing())


def test_an_outlier_is_reported_with_joint_and_time_and_replaced() -> None:
    values = swing()
    values[100, 1] += 0.4
    examination = examine(recording(values), ARM)
    (finding,) = examination.findings
    assert (finding.code, finding.column, finding.repaired, finding.spans) == ("spikes", "elbow", True, [(1.0, 1.0)])
    assert "elbow has 1 outlier, the first at 1 s" in finding.sentence
    assert np.abs(examination.recording.values - swing()).max() < 1e-3


def test_an_abrupt_change_of_velocity_is_no_outlier() -> None:
    values = swing()
    values[100:] += np.linspace(0, -1.5, 101)[:, None]
    assert not [finding for finding in examine(recording(values), ARM).findings if finding.code == "spikes"]


def test_rests_at_both_ends_are_trimmed_to_a_short_one() -> None:
    rest = np.ones((150, 1))
    values = np.concatenate([rest * swing()[0], swing(), rest * swing()[-1]])
    examination = examine(recording(values), ARM)
    assert [finding.code for finding in examination.findings] == ["idle", "idle"]
    assert 2.0 < np.ptp(examination.recording.times) < 2.3
    assert "nothing moves for 1." in sentences(examination)


def test_a_joint_with_the_rounding_errors_of_a_simulation_is_at_rest() -> None:
    """The rests are trimmed, although this joint, whose range is small too, changes in every sample."""
    rest = np.ones((150, 1))
    values = np.concatenate([rest * swing()[0], swing(), rest * swing()[-1]])
    values[:, 1] = 1e-17 * np.sin(np.arange(len(values)))
    assert [finding.code for finding in examine(recording(values), ARM).findings].count("idle") == 2


@pytest.mark.parametrize(
    ("values", "times", "said"),
    [
        (swing()[:8], None, "8 samples to learn from; at least 10 are needed"),
        (0 * swing(), None, "shows no movement"),
        (np.tile(swing(), (2, 1)), np.tile(np.arange(201) / 100, 2), "goes back from 2 s to 0 s at sample 201"),
    ],
)
def test_a_recording_that_cannot_be_learned_is_refused(values: np.ndarray, times: np.ndarray | None, said: str) -> None:
    made = recording(values)
    refusal = examine(made if times is None else replace(made, times=times), ARM).refusal
    assert refusal is not None
    assert said in refusal.sentence


def test_several_faults_in_one_recording_are_all_found() -> None:
    rng = np.random.default_rng(3)
    clean = synthetic(rng, shipped())
    faulty, codes = clean.recording, ("idle", "spikes", "gap", "degrees")
    for code in codes:
        mutation = next(mutation for mutation in MUTATIONS if mutation.code == code)
        faulty, _ = mutation.put(rng, replace(clean, recording=faulty))
    found = {finding.code for finding in examine(faulty, clean.arm).findings}
    assert set(codes) <= found


def test_without_an_arm_angles_beyond_two_turns_are_taken_for_degrees() -> None:
    assert not examine(recording(5 * swing()), None).findings
    assert examine(recording(50 * swing()), None).findings[0].code == "degrees"


@pytest.mark.parametrize("held", [3, 5])
def test_repeated_samples_of_a_slower_source_keep_the_duration(held: int) -> None:
    values = swing()[np.arange(201) // held * held]
    repaired = examine(recording(values), ARM).recording
    assert np.ptp(repaired.times) == pytest.approx(2.0, abs=0.05)
    late = np.stack([np.interp(repaired.times, np.linspace(0, 2, 201), joint) for joint in swing().T], axis=1)
    assert np.abs(repaired.values - late).max() < 0.05


def strokes(hertz: float, rate: float) -> np.ndarray:
    """Return 10 s of oscillations at `hertz`, in which all joints reverse together, sampled at `rate` Hz."""
    times = np.arange(round(10 * rate) + 1) / rate
    s = np.clip(np.minimum(times, 10 - times) / 0.5, 0, 1)
    return (0.1 * s**2 * (3 - 2 * s) * np.sin(2 * np.pi * hertz * times))[:, None] * [1.0, 0.7]


@pytest.mark.parametrize(("hertz", "rate"), [(2.0, 100.0), (4.0, 30.0)])
def test_fast_oscillations_are_not_repaired(hertz: float, rate: float) -> None:
    examination = examine(recording(strokes(hertz, rate), rate), ARM)
    assert not any(finding.repaired for finding in examination.findings)


@pytest.mark.parametrize("row", [0, -1])
def test_an_outlier_in_the_first_or_last_sample_is_replaced(row: int) -> None:
    values = swing()
    values[row, 1] = 0.4
    examination = examine(recording(values), ARM)
    (finding,) = examination.findings
    assert (finding.code, finding.column, finding.repaired) == ("spikes", "elbow", True)
    assert np.abs(examination.recording.values - swing()).max() < 0.001


def test_samples_in_reverse_order_are_sorted_and_reported() -> None:
    """The stamps do not show whether the file's order or their own is the movement's."""
    clean = recording(swing() + 0.1)
    examination = examine(replace(clean, times=clean.times[::-1], values=clean.values[::-1]), ARM)
    assert [(one.code, one.repaired) for one in examination.findings] == [("backwards", True), ("backwards", False)]
    assert np.array_equal(examination.recording.values, clean.values)
    said = examination.findings[1].sentence
    assert "the movement begins with the last sample of the file" in said
    assert "if the first was recorded first, give --rate" in said


@pytest.mark.parametrize("pattern", [(0, 1), (0, 0, 1)])
def test_samples_of_two_movements_in_turn_are_refused(pattern: tuple[int, ...]) -> None:
    """As two arms make them that publish under the same names on one topic, at one rate or at two."""
    values = swing()
    values[np.resize(pattern, len(values)) == 1] += 0.3
    refusal = examine(recording(values), ARM).refusal
    assert refusal is not None
    assert refusal.code == "interleaved"
    assert "samples of two movements in turn: " in refusal.sentence
    assert re.search(r"is at -?0.000, then at 0.300 rad from sample \d to \d", refusal.sentence)


@pytest.mark.parametrize("size", [0.05, 0.5])
def test_noise_is_no_second_movement(size: float) -> None:
    noisy = recording(swing() + size * np.random.default_rng(4).normal(size=swing().shape))
    assert "in turn" not in sentences(examine(noisy, ARM))


def test_a_short_rest_before_a_fast_start_is_a_rest() -> None:
    """As in guiding: 0.08 s of 3 s at 1 kHz, too short for the few functions of the examination."""
    since = np.clip(np.linspace(0, 3, 3001) - 0.08, 0, None)[:, None] / 0.3
    values = np.array([1.9, -1.2]) * (1 - np.exp(-since) * (1 + since))
    assert "begins moving" not in sentences(examine(recording(values, 1000.0), ARM))


def test_sentences_name_the_times_of_the_file_also_after_a_rest_was_trimmed() -> None:
    values = np.concatenate([np.zeros((100, 2)), swing()])
    values[150:230, 1] = values[150, 1]
    raw = recording(values)
    keep = np.r_[:260, 290 : len(values)]
    said = sentences(examine(replace(raw, times=raw.times[keep], values=values[keep]), ARM))
    assert "nothing moves for 1" in said
    assert "0.31 s after 2.59 s" in said
    assert "rad for 0.79 s from 1.5 s on" in said


def test_a_preview_names_the_joint_that_prevents_playing() -> None:
    raw = recording(5 * swing())
    assert preview(raw, examine(raw, ARM), ARM).refusal.startswith("shoulder: the requested position 4 rad")
