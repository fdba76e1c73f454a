"""Statistics of thrown balls."""

from protocol import messages as m
from robot.striking.launcher import Launch
from tools.rally.limit_watch import Findings
from tools.rally.play import Stroke
from tools.rally.report import sentence, summary
from tools.rally.touches import touched

LAUNCH = Launch((4.0, 0.0, 1.0), (-4.0, 0.0, 3.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0, 1)


def contact(*bodies: str, ended: bool = False) -> m.Contact:
    return m.Contact(time=1.5, bodies=list(bodies), impulse=0.02, ball_velocity=None, ended=ended)


def test_a_contact_that_does_not_involve_the_ball_is_a_violation():
    assert touched(contact("floor", "racket")) == "floor and racket touched at 1.500 s"
    assert touched(contact("racket", "ball")) == touched(contact("floor", "racket", ended=True)) == ""
    strokes = [
        Stroke(LAUNCH, touched=["floor and racket touched at 1.500 s"]),
        Stroke(LAUNCH, limits=Findings(ticks=200, violations=7)),
        Stroke(LAUNCH),
    ]
    found = summary(strokes)
    assert {name: found[name] for name in ("touched", "violations", "ticks_beyond", "ticks_checked")} == {
        "touched": 1,
        "violations": 2,
        "ticks_beyond": 7,
        "ticks_checked": 200,
    }
    assert sentence(strokes).endswith("limits were passed at 7 of 200 ticks; 2 violations")
