"""The lead time between a request and the start of its plan."""

import pytest

from services.planner.lead_time import LeadTime


def test_the_lead_adapts_to_planning_times():
    lead = LeadTime(0.001)
    unknown = lead.seconds()
    for _ in range(50):
        lead.note(0.004)
    assert lead.seconds() == pytest.approx(0.001 + 0.004)
    assert lead.seconds() < unknown
    for _ in range(50):
        lead.note(0.02)
    assert lead.seconds() == pytest.approx(0.001 + 0.02)


def test_the_lead_does_not_adapt_before_ten_measurements():
    """The first goals after a start are slower, because of cold caches and a busy bus."""
    lead = LeadTime(0.001)
    unknown = lead.seconds()
    assert unknown >= 0.025
    for _ in range(8):
        lead.note(0.009)
        assert lead.seconds() == unknown
    for _ in range(3):
        lead.note(0.009)
    assert lead.seconds() == pytest.approx(0.001 + 0.009)


def test_a_single_slow_plan_affects_only_the_lead_of_a_second_try():
    lead = LeadTime(0.001)
    for seconds in [0.1, *[0.004] * 49]:
        lead.note(seconds)
        lead.note(seconds, "correction")
    assert lead.seconds() == pytest.approx(0.005)
    assert lead.seconds(again=True) == pytest.approx(0.101)
    assert lead.seconds(again=True, kind="correction") == pytest.approx(0.007)


def test_a_second_try_has_twice_the_last_planning_time_and_a_correction_1_5_times():
    lead = LeadTime(0.001)
    for seconds in [0.004] * 50 + [0.2]:
        lead.note(seconds)
        lead.note(seconds, "correction")
    assert lead.seconds(again=True) == pytest.approx(0.001 + 0.4)
    assert lead.seconds(again=True, kind="correction") == pytest.approx(0.001 + 0.3)


def test_a_goal_that_can_wait_has_half_a_second_after_a_late_plan():
    """Not after a plan that another one superseded: then the machine is not too slow."""
    lead = LeadTime(0.001)
    for late, expected in ((True, 0.501), (False, 0.041)):
        lead.note(0.02, late=late)
        assert lead.seconds(again=True, can_wait=True) == pytest.approx(expected)
        assert lead.seconds(again=True) == pytest.approx(0.041)
        assert lead.seconds(can_wait=True) == pytest.approx(0.026)


def test_a_fixed_lead_and_that_of_the_stepped_clock_do_not_adapt():
    for lead, expected in ((LeadTime(0.001, 0.03), 0.03), (LeadTime(0.001), 0.02)):
        lead.stepped = expected == 0.02
        lead.note(1.0)
        assert lead.seconds() == lead.seconds(again=True) == expected


def test_a_late_plan_increases_the_lead_even_if_planning_was_quick():
    """The robot's time was then predicted too early."""
    lead = LeadTime(0.001)
    for _ in range(50):
        lead.note(0.004, "correction")
    assert lead.seconds(kind="correction") == pytest.approx(0.005)
    for expected in (0.005, 0.006):
        lead.note(0.004, "correction", late=True)
        assert lead.seconds(kind="correction") == pytest.approx(expected)
