"""Statistics of thrown balls."""

from protocol import messages as m
from robot.striking.launcher import Launch
from tools.rally.limit_monitor import LimitReport
from tools.rally.play import Stroke
from tools.rally.received import forbidden_contact
from tools.rally.report import sentence, summary

LAUNCH = Launch((4.0, 0.0, 1.0), (-4.0, 0.0, 3.0), (0.0, 0.0, 1.0), 1.0, 1)


def contact(*bodies: str, ended: bool = False) -> m.Contact:
    return m.Contact(time=1.5, bodies=list(bodies), impulse=0.02, ball_velocity=None, ended=ended)


def test_a_contact_that_does_not_involve_the_ball_is_a_violation():
    assert forbidden_contact(contact("floor", "racket")) == "floor and racket touched at 1.500 s"
    assert (
        forbidden_contact(contact("racket", "ball")) == forbidden_contact(contact("floor", "racket", ended=True)) == ""
    )
    strokes = [
        Stroke(LAUNCH, forbidden_contacts=["floor and racket touched at 1.500 s"]),
        Stroke(LAUNCH, limits=LimitReport(ticks=200, violations=7)),
        Stroke(LAUNCH),
    ]
    found = summary(strokes)
    assert {name: found[name] for name in ("touched", "violations", "ticks_beyond", "ticks_checked")} == {
        "touched": 1,
        "violations": 2,
        "ticks_beyond": 7,
        "ticks_checked": 200,
    }
    assert sentence(strokes).endswith("limits were exceeded at 7 of 200 ticks; 2 violations")
