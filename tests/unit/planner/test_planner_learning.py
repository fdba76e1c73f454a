"""Learning primitives from `learn` requests and recordings."""

from pathlib import Path

import numpy as np
import pytest

from motion.errors import InvalidMotion
from motion.primitive import Primitive
from protocol import messages as m
from protocol.codec import matrix_bytes
from protocol.errors import Refusal
from services.planner.learning import demonstration_of, learn_demonstration, learn_from_csv, learned_message, spread_of

TIMES = np.arange(200) / 200
PATH = np.sin(np.outer(TIMES, [1.0, 2.0, 3.0]))
NAMES = ("a", "b", "c")


def request(**fields: object) -> m.Learn:
    """Return a `learn` request of three joints at 200 Hz."""
    return m.Learn(**{"name": "wave", "positions": PATH.tolist(), "rate": 200.0, **fields})  # type: ignore[arg-type]


def learn_from_request(asked: m.Learn) -> Primitive:
    """Return the primitive learned from a request."""
    return learn_demonstration(demonstration_of(asked, NAMES), asked.smoothing, spread_of(asked, NAMES))


def test_equivalent_forms_of_a_request_give_the_same_primitive():
    """Rows or a matrix, with a rate or times."""
    matrix = {"positions": matrix_bytes(PATH), "joint_count": 3}
    times = {"rate": None, "times": TIMES.tolist()}
    made = [learn_from_request(request(**fields)) for fields in ({}, matrix, times, {**matrix, **times})]
    assert all(np.allclose(other.control_points, made[0].control_points, rtol=0, atol=1e-9) for other in made)
    assert made[0].joint_count == 3
    assert made[0].duration == pytest.approx(0.995)
    assert made[0].samples == 200


def test_the_reply_reports_the_requested_smoothing():
    assert learned_message("wave", learn_from_request(request(smoothing="none"))).smoothing is None
    given = m.SavitzkyGolay(window_s=0.105, order=4)
    said = learned_message("wave", learn_from_request(request(smoothing=given)))
    assert said.smoothing is not None
    assert (said.smoothing.window_s, said.smoothing.order) == (pytest.approx(0.105), 4)
    said = learned_message("wave", learn_from_request(request()), ["it ends moving"])
    assert said.smoothing is None
    assert (said.name, said.duration, said.samples, said.basis_count) == ("wave", pytest.approx(0.995), 200, 50)
    assert [len(v) for v in (said.fit_rms, said.noise_estimate, said.position_rms, said.position_max)] == [3] * 4
    assert said.warnings == ["it ends moving"]


def test_the_reply_has_positions_and_velocities_at_both_ends():
    said = learned_message("wave", learn_from_request(request()))
    assert said.start is not None
    assert said.goal is not None
    assert said.start.positions == pytest.approx([0, 0, 0], abs=1e-6)
    assert said.start.velocities == pytest.approx([1, 2, 3], abs=1e-3)
    assert said.goal.positions == pytest.approx(PATH[-1], abs=1e-6)
    assert said.goal.velocities == pytest.approx(np.cos(0.995 * np.arange(1, 4)) * np.arange(1, 4), abs=1e-3)


@pytest.mark.parametrize(
    ("field", "fields"),
    [
        ("positions", {"positions": []}),
        ("positions", {"positions": [[0.0], [0.0, 0.0]]}),
        ("positions", {"positions": PATH[:9].tolist()}),
        ("positions", {"positions": b"", "joint_count": 3}),
        ("positions", {"positions": bytes(23), "joint_count": 3}),
        ("positions", {"positions": (PATH + 1e5).tolist()}),
        ("positions", {"positions": np.zeros((200, 65)).tolist()}),
        ("joint_count", {"positions": bytes(24)}),
        ("joint_count", {"joint_count": 4}),
        ("positions", {"positions": PATH[:, :2].tolist()}),
        ("joint_names", {"joint_names": ["a", "b"]}),
        ("joint_names", {"joint_names": ["a", "b", "d"]}),
        ("joint_names", {"joint_names": ["a", "b", "b"]}),
        ("rate", {"rate": None}),
        ("rate", {"times": TIMES.tolist()}),
        ("rate", {"rate": 0.0}),
        ("rate", {"rate": 1e-3}),
        ("rate", {"rate": 1e308}),
        ("times", {"rate": None, "times": TIMES[:-1].tolist()}),
        ("times", {"rate": None, "times": TIMES[::-1].tolist()}),
        ("times", {"rate": None, "times": (TIMES * 1e-300).tolist()}),
        ("positions", {"rate": None, "times": [0.0] * 195 + TIMES[:5].tolist()}),
        ("times", {"rate": None, "times": [*TIMES[:100].tolist(), *(TIMES[99:-1] - 1e-9).tolist()]}),
        ("smoothing.order", {"smoothing": m.SavitzkyGolay(window_s=0.5, order=80)}),
        ("smoothing.order", {"smoothing": m.SavitzkyGolay(window_s=0.5, order=1)}),
        ("smoothing.window_s", {"smoothing": m.SavitzkyGolay(window_s=1.5, order=3)}),
        ("smoothing.window_s", {"smoothing": m.SavitzkyGolay(window_s=0.01, order=5)}),
    ],
)
def test_an_invalid_request_is_refused_with_its_field(field: str, fields: dict[str, object]):
    """Also if its numbers would overflow."""
    with pytest.raises(Refusal) as caught:
        learn_from_request(request(**fields))
    assert (caught.value.code, caught.value.detail["field"]) == ("bad_message", field)
    assert field in caught.value.message


def test_columns_are_put_in_the_order_of_the_arm():
    plain = learn_from_request(request())
    named = learn_from_request(request(positions=PATH[:, [2, 0, 1]].tolist(), joint_names=["c", "a", "b"]))
    assert np.array_equal(named.control_points, plain.control_points)


def test_a_spread_is_kept_in_the_order_of_the_arm():
    rows = [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]
    primitive = learn_from_request(request(joint_names=["c", "a", "b"], spread=rows))
    assert primitive.spread.tolist() == [[0.2, 0.5], [0.3, 0.6], [0.1, 0.4]]
    assert learn_from_request(request()).spread.shape == (3, 0)


@pytest.mark.parametrize(
    "spread", [[], [[0.1, 0.1, 0.1]], [[0.1, 0.1]] * 2, [[0.1, 0.1, 0.0]] * 2, [[0.1], [0.1, 0.2]]]
)
def test_a_malformed_spread_is_refused(spread: list[list[float]]):
    with pytest.raises(Refusal) as caught:
        learn_from_request(request(spread=spread))
    assert caught.value.detail["field"] == "spread"
    assert "spread" in caught.value.message


def test_joint_names_of_another_arm_are_refused_with_both_lists():
    with pytest.raises(Refusal, match=r"joint_names are a, b, z; the arm's are a, b, c: send the name on this arm"):
        learn_from_request(request(joint_names=["a", "b", "z"]))


def test_times_that_go_back_are_refused_with_the_samples():
    times = TIMES.tolist()
    times[7] = 0.02
    with pytest.raises(Refusal, match=r"sample 7's time 0.02 s lies before sample 6's"):
        learn_from_request(request(rate=None, times=times))


def test_samples_with_the_same_time_are_averaged():
    times, path = np.repeat(TIMES, 2), np.repeat(PATH, 2, axis=0)
    path[::2] += 0.01
    path[1::2] -= 0.01
    primitive = learn_from_request(request(rate=None, times=times.tolist(), positions=path.tolist()))
    assert primitive.samples == len(TIMES)
    assert np.abs(primitive.sample(TIMES / TIMES[-1]).positions - PATH).max() < 1e-4


def test_samples_at_nearly_the_same_time_are_learned():
    times = [0.0, 1e-300, *TIMES[1:-1].tolist()]
    assert learn_from_request(request(rate=None, times=times)).position_max.max() < 0.02


def test_a_csv_file_is_learned_only_for_its_own_arm(tmp_path: Path):
    path = tmp_path / "wave.csv"
    np.savetxt(path, np.column_stack([TIMES, PATH]), delimiter=",", header="time,a,b,c", comments="")
    primitive = learn_from_csv(path, ("a", "b", "c"))
    assert primitive is not None
    assert primitive.joint_count == 3
    assert learn_from_csv(path, ("a", "b", "d")) is None
    path.write_text("time,a,b,c\n0,0,0,0\n1,1,1,1\n")
    with pytest.raises(InvalidMotion, match="at least 10"):
        learn_from_csv(path, ("a", "b", "c"))


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"spread": [[0.1] * 3]}, "spread has 1 rows; it must have 2 to 1001"),
        ({"spread": [[0.1] * 3, [0.1, 0.0, 0.1]]}, "spread[1][1] is 0 rad; it must be greater than 0"),
        ({"spread": [[0.1] * 3, [0.1]]}, "spread[1] has 1 numbers, and spread[0] has 3"),
        ({"positions": [*PATH[:20].tolist(), [0.0]]}, "positions[20] has 1 numbers, and positions[0] has 3"),
        ({"positions": bytes(24), "joint_count": -1}, "joint_count is -1; it must say how many columns"),
        ({"positions": bytes(24)}, "joint_count is null; it must say how many columns"),
        ({"rate": 1e-3}, "so 0.0553 to 1.99e+04 Hz"),
    ],
)
def test_a_refusal_names_place_value_and_remedy(fields: dict[str, object], said: str):
    with pytest.raises(Refusal) as caught:
        learn_from_request(request(**fields))
    assert said in caught.value.message
