"""From `learn` requests and recordings to primitives."""

from pathlib import Path

import numpy as np
import pytest

from motion.errors import InvalidMotion
from protocol import messages as m
from protocol.codec import matrix_bytes
from protocol.errors import Refusal
from services.planner.learning import learn_from_csv, learn_from_request, learned_message

TIMES = np.arange(200) / 200
PATH = np.sin(np.outer(TIMES, [1.0, 2.0, 3.0]))


def request(**fields: object) -> m.Learn:
    """A demonstration of three joints at 200 Hz."""
    return m.Learn(**{"name": "wave", "positions": PATH.tolist(), "rate": 200.0, **fields})  # type: ignore[arg-type]


def test_every_way_to_say_the_same_gives_the_same():
    """Rows or a matrix, a rate or times."""
    matrix = {"positions": matrix_bytes(PATH), "joint_count": 3}
    times = {"rate": None, "times": TIMES.tolist()}
    made = [learn_from_request(request(**fields)) for fields in ({}, matrix, times, {**matrix, **times})]
    assert all(np.allclose(other.theta, made[0].theta, rtol=0, atol=1e-9) for other in made)
    assert made[0].joint_count == 3
    assert made[0].duration == pytest.approx(0.995)
    assert made[0].samples == 200


def test_smoothing_is_used_as_asked_and_told():
    """Chosen, none, or given."""
    assert learned_message("wave", learn_from_request(request(smoothing="none"))).smoothing is None
    given = m.SavitzkyGolay(window_s=0.105, order=4)
    said = learned_message("wave", learn_from_request(request(smoothing=given)))
    assert said.smoothing is not None
    assert (said.smoothing.window_s, said.smoothing.order) == (pytest.approx(0.105), 4)
    said = learned_message("wave", learn_from_request(request()))
    assert said.smoothing is not None
    assert (said.name, said.duration, len(said.fit_rms)) == ("wave", pytest.approx(0.995), 3)


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
        ("rate", {"rate": None}),
        ("rate", {"times": TIMES.tolist()}),
        ("rate", {"rate": 0.0}),
        ("rate", {"rate": 1e-3}),
        ("rate", {"rate": 1e308}),
        ("times", {"rate": None, "times": TIMES[:-1].tolist()}),
        ("times", {"rate": None, "times": TIMES[::-1].tolist()}),
        ("times", {"rate": None, "times": (TIMES * 1e-300).tolist()}),
        ("times", {"rate": None, "times": [0.0, 1e-300, *TIMES[1:-1].tolist()]}),
        ("times", {"rate": None, "times": [*TIMES[:100].tolist(), *(TIMES[99:-1] + 1e-9).tolist()]}),
        ("smoothing.order", {"smoothing": m.SavitzkyGolay(window_s=0.5, order=80)}),
        ("smoothing.order", {"smoothing": m.SavitzkyGolay(window_s=0.5, order=1)}),
        ("smoothing.window_s", {"smoothing": m.SavitzkyGolay(window_s=1.5, order=3)}),
        ("smoothing.window_s", {"smoothing": m.SavitzkyGolay(window_s=0.01, order=5)}),
    ],
)
def test_what_cannot_be_learned(field: str, fields: dict[str, object]):
    """Is refused by field, before anything overflows."""
    with pytest.raises(Refusal) as caught:
        learn_from_request(request(**fields))
    assert (caught.value.code, caught.value.detail["field"]) == ("bad_message", field)
    assert field in caught.value.message


def test_a_recording_of_this_arm_is_learned(tmp_path: Path):
    """Another arm's is left to it."""
    path = tmp_path / "wave.csv"
    np.savetxt(path, np.column_stack([TIMES, PATH]), delimiter=",", header="time,a,b,c", comments="")
    primitive = learn_from_csv(path, ("a", "b", "c"))
    assert primitive is not None
    assert primitive.joint_count == 3
    assert learn_from_csv(path, ("a", "b", "d")) is None
    path.write_text("time,a,b,c\n0,0,0,0\n1,1,1,1\n")
    with pytest.raises(InvalidMotion, match="at least 10"):
        learn_from_csv(path, ("a", "b", "c"))
