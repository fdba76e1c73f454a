"""Output of the shell for replies, and the live screen of `watch`."""

from io import StringIO

import pytest
from msgspec.structs import replace
from rich.console import Console, RenderableType

from protocol import messages as m
from protocol.errors import Refusal
from protocol.topics import ENDED, QUERIES, STATUS
from tests.golden.examples import EXAMPLES
from tests.golden.values import JOINTS, REPORT, RESULT
from tools.shell.show import show
from tools.shell.tables import cell
from tools.shell.watch import WATCHED, View, event, render

REPLIES = {query.reply.__name__ for query in QUERIES}


def printed(renderable: RenderableType) -> str:
    console = Console(width=140, file=StringIO())
    with console.capture() as captured:
        console.print(renderable)
    return captured.get()


@pytest.mark.parametrize("stem", sorted(REPLIES))
@pytest.mark.parametrize("names", [JOINTS, []])
def test_every_reply_can_be_printed(stem, names):
    assert printed(show(EXAMPLES[stem], names)).strip()


def test_headers_have_units():
    text = printed(show(EXAMPLES["GoalReply"], JOINTS))
    assert all(unit in text for unit in ("[rad]", "[rad/s]", "[rad/s²]", "[rad/s³]"))
    assert "[N·m]" in printed(show(EXAMPLES["State"], JOINTS))


def test_a_goal_reply_shows_its_hit_time_and_active_limits():
    text = printed(show(EXAMPLES["GoalReply"], JOINTS))
    assert "hits at 5.050 s (0.800 s later)" in text
    assert "shaped by the limits on accelerations of joint_1 at 0.375 s" in text
    assert "inside all limits at all times" in text


def test_a_goal_reply_shows_alternative_phase_and_deviations():
    text = printed(show(EXAMPLES["GoalReply"], JOINTS))
    assert "plays alternative 2 · goes on at phase 0.625 of the demonstration" in text
    assert "50 functions a joint" in text
    assert all(f"{which} {what} [rad]" in text for which in ("deviation", "by limits") for what in ("rms", "max"))
    bare = replace(EXAMPLES["GoalReply"], positions=[], velocities=[], report=replace(REPORT, deviation=None))
    assert "deviation rms" not in printed(show(bare, JOINTS))


def test_a_result_shows_the_duration_of_each_stage():
    assert "planned 5.0 ms, then accepted 1.0 ms, then first command 20.0 ms" in printed(show(RESULT, JOINTS))
    bare = m.Result(goal_id="g", outcome="canceled", reason="asked to")
    assert "the hit was not reached" in printed(show(bare, JOINTS))
    assert "the hit was not reached" not in printed(show(m.Result(goal_id="g", outcome="running"), JOINTS))


def test_a_learned_primitive_shows_errors_and_warnings():
    text = printed(show(EXAMPLES["Learned"], JOINTS))
    assert "learned wipe · 0.025 s · 200 samples · 50 functions a joint · smoothed over 0.2 s, order 5" in text
    headers = "position error rms [rad]", "position error max [rad]", "acceleration error rms [rad/s²]", "noise [rad]"
    assert all(header in text for header in headers)
    assert all(f"{end} [{unit}]" in text for end in ("start", "goal") for unit in ("rad", "rad/s"))
    assert "warning: the demonstration ends moving: joint_1 at 0.5 rad/s" in text
    bare = m.Learned(name="wipe", duration=1.0, basis_count=20, fit_rms=[0.5], noise_estimate=[0.0])
    text = printed(show(bare, []))
    assert "20 functions a joint" in text and "smoothed" not in text
    assert not any(words in text for words in ("samples", "position error", "start", "warning"))


def test_an_empty_library_shows_how_to_learn():
    assert "volley learn FILE" in printed(show(m.Primitives(primitives=[]), []))


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "–"), (True, "yes"), (0.82, "0.82"), (-3e-14, "0"), (15000.0, "15000"), ([-2.0, 2.5], "-2 … 2.5")],
)
def test_cells_of_tables(value, text):
    assert cell(value) == text


def view_of(*stems: str, stepped: bool = False) -> View:
    """Return a view that received the named messages at 100 s."""
    topics = {topic.message.__name__: topic for topic in WATCHED}
    view = View(joint_names=JOINTS, stepped=stepped, alive={"sim", "controller"})
    for stem in stems:
        view.take(topics[stem], EXAMPLES[stem], 100.0)
    return view


def test_an_optional_service_is_listed_while_it_runs():
    view = view_of("Status")
    view.alive |= {"striker"}
    assert "● striker" in printed(render(view, 100.1))


def test_the_screen_shows_status_and_events():
    text = printed(render(view_of("Status", "Plan", "Refused", "Contact", "Result", "Disturbance"), 100.1))
    assert "● sim  ○ recorder  ○ planner  ● controller" in text
    assert "tracking · goal forehand-7 · at 4.500 s, 0.250 s into the motion" in text
    assert "99.95 % on time" in text
    assert "plan forehand-7: forehand, corrects forehand-6 at phase 0.625, hits at 4.252 s" in text
    assert "refused forehand-8 as late: arrival_time 4.25 s has passed" in text
    assert "racket parted from ball: 0.375 N·s, ball at 6.58 m/s" in text
    assert "succeeded forehand-7, off by 0.002 rad: played to rest" in text
    assert "disturbed by acceleration, sensor_noise" in text
    assert "no status" not in text


def test_the_screen_shows_why_there_is_no_status():
    alone = View(joint_names=[], stepped=False)
    assert "no status yet: nobody is on this bus" in printed(render(alone, 100.0))
    assert "no status yet: waiting for the controller" in printed(render(view_of(), 100.0))
    assert "no status for 3 s" in printed(render(view_of("Status"), 103.0))
    assert "the stepped clock waits" in printed(render(view_of("Status", stepped=True), 103.0))
    gone = view_of("Status")
    gone.alive = {"sim"}
    assert "the controller is gone" in printed(render(gone, 103.0))


def test_a_malformed_publication_is_an_event():
    view = view_of()
    view.take(STATUS, Refusal("bad_message", "the body looks like JSON", field=""), 100.0)
    assert view.status is None
    assert list(view.events) == ["malformed status: the body looks like JSON"]


def test_only_the_last_events_are_shown():
    view = view_of()
    for number in range(20):
        view.take(ENDED, m.Result(goal_id=f"g{number}", outcome="succeeded"), 100.0)
    assert len(view.events) == 8
    assert "g19" in view.events[-1]


def test_a_refused_goal_without_an_id_is_an_event():
    assert "refused a goal as bad_message: positions is missing" in event(EXAMPLES["Refused-unread"])


def test_the_end_of_disturbances_is_an_event():
    assert "disturbed no more" in event(m.Disturbance(time=1.0, active=[]))
