"""The default layout of a trace in the viewer, and the style of its curves."""

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from robot.description import RobotConfig
from services.recorder import entities
from services.recorder.scene import Scene, View
from services.recorder.writer import TraceWriter

MEASURED, REFERENCE, PLANNED = (38, 139, 210), (245, 158, 66), (110, 190, 110)
DEMONSTRATED, LIMITS, PUSH, ERROR = (150, 150, 160), (200, 60, 60), (220, 38, 127), (190, 120, 220)
MODES = {"holding": (122, 134, 154), "tracking": (63, 160, 90), "stopping": (227, 155, 45), "fault": (212, 60, 60)}
AXES = {"x": (220, 80, 80), "y": (110, 190, 110), "z": (80, 140, 230)}
LIVE_WINDOW_S = 10.0
EYE = np.array([1.5, -1.7, 0.6])
"""Vector from the arm's centre to the camera, in radii of the arm: beside it and slightly above."""


def build_blueprint(config: RobotConfig, live: bool) -> rrb.Blueprint:
    """Return the layout: scene, lanes and events on the left; on the right the curves and the loop's timing.

    `live`: the curves show the last ten seconds and the cursor follows, instead of the whole trace.
    """
    names, window = config.joint_names, _window() if live else None
    strikes = [_strikes(window)] if config.court else []
    lanes = rrb.StateTimelineView(origin="/lanes", name="Mode, goal, disturbance, brake", time_ranges=window)
    events = rrb.TextLogView(origin="/events", name="Events")
    left = rrb.Vertical(_scene(Scene(config).view()), lanes, events, row_shares=[5, 3 if strikes else 2, 2])
    tabs = [_overview(names, window), *(_joint(name, window) for name in names), *strikes, _loop(window)]
    return rrb.Blueprint(
        rrb.Horizontal(left, rrb.Tabs(*tabs, active_tab=0), column_shares=[1, 1]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline="sim_time", play_state="following" if live else None),
    )


def style(trace: TraceWriter, names: Sequence[str]) -> None:
    """Write colours of the curves and their names in the legends."""
    for name in names:
        _style_streams(trace, name)
        _style_plans(trace, name)
        for entity in entities.PUSHES.values():
            trace.static(entity.at(name), _line(f"push, {entity.unit}", PUSH, 1.5))
    for entity in (entities.TORQUES, entities.POSITION_ERROR, entities.VELOCITY_ERROR):
        trace.static(entity.path, rr.SeriesLines(names=list(names)))
    trace.static(entities.BALL_POSITION.path, rr.SeriesLines(names=list(AXES), colors=list(AXES.values()), widths=1.5))
    trace.static(entities.PREDICTION_SPREAD.path, _decided(AXES))
    trace.static(entities.EXPECTED_ERROR.path, _decided({"expected": REFERENCE}))
    trace.static(entities.REVISIONS.path, _decided({"corrections": PLANNED}))
    landed = rr.SeriesPoints(colors=[MEASURED], names=["landed"], markers="Diamond", marker_sizes=5.0)
    trace.static(entities.LANDING_DISTANCE.path, landed)
    trace.static(entities.LATE.path, rr.SeriesLines(names=["p50", "p99", "max"]))
    modes = rr.StateConfiguration(values=list(MODES), colors=list(MODES.values()))
    trace.static(entities.MODE_LANE.path, modes)


def _style_streams(trace: TraceWriter, name: str) -> None:
    for measured, reference in (
        (entities.MEASURED_POSITION, entities.REFERENCE_POSITION),
        (entities.MEASURED_VELOCITY, entities.REFERENCE_VELOCITY),
    ):
        trace.static(measured.at(name), _line("measured", MEASURED, 3.0))
        trace.static(reference.at(name), _line("reference", REFERENCE, 0.8))
    trace.static(entities.COMMANDED.at(name), _line("commanded", MEASURED, 1.0))
    trace.static(entities.ERROR.at(name), _line("measured - reference", ERROR, 1.0))


def _style_plans(trace: TraceWriter, name: str) -> None:
    ends = ["lower limit", "upper limit"]
    bounds = rr.SeriesLines(colors=[LIMITS] * 2, names=ends, widths=1.0, interpolation_mode="StepAfter")
    for quantity, planned in entities.PLANNED.items():
        trace.static(planned.at(name), _line("planned", PLANNED, 1.5))
        trace.static(entities.LIMITS[quantity].at(name), bounds)
    trace.static(entities.DEMONSTRATED.at(name), _line("demonstrated", DEMONSTRATED, 1.5))
    target = rr.SeriesPoints(colors=[REFERENCE], names=["goal, waypoints"], markers="Diamond", marker_sizes=5.0)
    trace.static(entities.TARGET.at(name), target)
    corrected = rr.SeriesPoints(colors=[PLANNED], names=["corrected"], markers="Circle", marker_sizes=3.0)
    trace.static(entities.CORRECTED.at(name), corrected)


def _line(name: str, colour: tuple[int, int, int], width: float) -> rr.SeriesLines:
    return rr.SeriesLines(colors=colour, names=name, widths=width)


def _decided(colours: dict[str, tuple[int, int, int]]) -> rr.SeriesLines:
    """Return the style of values that hold from one decision to the next, also across balls."""
    names, colors = list(colours), list(colours.values())
    return rr.SeriesLines(names=names, colors=colors, widths=1.5, interpolation_mode="StepAfter")


def _window() -> rrb.VisibleTimeRange:
    return rrb.VisibleTimeRange(
        "sim_time",
        start=rrb.TimeRangeBoundary.cursor_relative(seconds=-LIVE_WINDOW_S),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )


def _scene(view: View) -> rrb.Spatial3DView:
    eye = rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=view.centre + EYE * view.radius,
        look_target=view.centre,
        eye_up=(0.0, 0.0, 1.0),
    )
    return rrb.Spatial3DView(
        origin="/world",
        name="The arm",
        eye_controls=eye,
        line_grid=rrb.LineGrid3D(visible=False),
        background=rrb.Background(color=(24, 28, 36)),
    )


def _plot(
    name: str, contents: list[str], window: rrb.VisibleTimeRange | None, legend: bool = True
) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        origin="/",
        name=name,
        contents=contents,
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=legend),
        time_ranges=window,
    )


def _overview(names: Sequence[str], window: rrb.VisibleTimeRange | None) -> rrb.Grid:
    """Positions of all joints; the last plot has the legend of all."""
    plots = [
        _plot(f"{name}, rad", [f"/joints/{name}/position/**"], window, legend=index == len(names) - 1)
        for index, name in enumerate(names)
    ]
    return rrb.Grid(*plots, grid_columns=2, name="All joints")


def _joint(name: str, window: rrb.VisibleTimeRange | None) -> rrb.Vertical:
    joint = f"/joints/{name}"
    return rrb.Vertical(
        _plot("Position, rad", [f"{joint}/position/**"], window),
        _plot("Velocity, rad/s", [f"{joint}/velocity/**"], window),
        _plot("Acceleration, rad/s²", [f"{joint}/acceleration/**"], window),
        _plot("Tracking error, rad", [entities.ERROR.at(name)], window),
        _plot("Disturbance", [f"{joint}/disturbance/**"], window),
        row_shares=[3, 2, 2, 2, 1],
        name=name,
    )


def _strikes(window: rrb.VisibleTimeRange | None) -> rrb.Vertical:
    distances = [entities.EXPECTED_ERROR.path, entities.LANDING_DISTANCE.path]
    return rrb.Vertical(
        _plot("Ball, m", [entities.BALL_POSITION.path], window),
        _plot("Spread of the ball at the touch, m", [entities.PREDICTION_SPREAD.path], window),
        _plot("Landing's distance from the target, m", distances, window),
        _plot("Corrections of a swing", [entities.REVISIONS.path], window),
        name="Strikes",
    )


def _loop(window: rrb.VisibleTimeRange | None) -> rrb.Vertical:
    lost = [entities.LOOP["missed"].path, entities.LOOP["refused"].path, "/recorder/**"]
    return rrb.Vertical(
        _plot("State to command, µs", [entities.LATE.path], window),
        _plot("Ticks answered in time, share", [entities.LOOP["on_time_ratio"].path], window),
        _plot("Ticks missed, messages refused or lost", lost, window),
        _plot("Torque, N·m", [entities.TORQUES.path], window),
        name="Loop",
    )
