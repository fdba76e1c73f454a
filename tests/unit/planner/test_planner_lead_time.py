"""How far ahead the planner lets a plan begin."""

import pytest

from services.planner.lead_time import LeadTime


def test_it_follows_what_planning_takes():
    lead = LeadTime(0.001)
    unknown = lead.seconds()
    for _ in range(50):
        lead.note(0.004)
    assert lead.seconds() == pytest.approx(0.001 + 0.004)
    assert lead.seconds() < unknown
    for _ in range(50):
        lead.note(0.02)
    assert lead.seconds() == pytest.approx(0.001 + 0.02)


def test_one_quick_plan_is_not_believed():
    """The first goals after a start run into cold caches and a busy bus: 9 ms once do not make a lead."""
    lead = LeadTime(0.001)
    unknown = lead.seconds()
    assert unknown >= 0.025
    for _ in range(8):
        lead.note(0.009)
        assert lead.seconds() == unknown
    for _ in range(3):
        lead.note(0.009)
    assert lead.seconds() == pytest.approx(0.001 + 0.009)


def test_one_slow_plan_counts_only_after_a_late_one():
    lead = LeadTime(0.001)
    for seconds in [0.1, *[0.004] * 49]:
        lead.note(seconds)
        lead.note(seconds, "correction")
    assert lead.seconds() == pytest.approx(0.005)
    assert lead.seconds(again=True) == pytest.approx(0.101)
    assert lead.seconds(again=True, kind="correction") == pytest.approx(0.007)


def test_the_second_try_has_twice_what_the_first_took_and_a_correction_half_more():
    lead = LeadTime(0.001)
    for seconds in [0.004] * 50 + [0.2]:
        lead.note(seconds)
        lead.note(seconds, "correction")
    assert lead.seconds(again=True) == pytest.approx(0.001 + 0.4)
    assert lead.seconds(again=True, kind="correction") == pytest.approx(0.001 + 0.3)


def test_fixed_and_stepped_leads_do_not_adapt():
    for lead, expected in ((LeadTime(0.001, 0.03), 0.03), (LeadTime(0.001), 0.02)):
        lead.stepped = expected == 0.02
        lead.note(1.0)
        assert lead.seconds() == lead.seconds(again=True) == expected


def test_a_late_plan_took_at_least_the_lead_that_it_had():
    """Where the robot's time was foreseen too early, planning itself was quick; the next leads must be longer."""
    lead = LeadTime(0.001)
    for _ in range(50):
        lead.note(0.004, "correction")
    assert lead.seconds(kind="correction") == pytest.approx(0.005)
    for expected in (0.005, 0.006):
        lead.note(0.004, "correction", late=True)
        assert lead.seconds(kind="correction") == pytest.approx(expected)
