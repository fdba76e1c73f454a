"""Writer of the striker's decisions: predicted ball, chosen hit, corrections, outgoing ball, landing."""

import numpy as np
import rerun as rr

from protocol import messages as m
from services.recorder import entities
from services.recorder.context import Context
from services.recorder.validation import Received
from services.recorder.writer import Rows

PREDICTED, CHOSEN, LEFT, TARGET = (120, 190, 235), (245, 158, 66), (190, 230, 80), (235, 90, 90)
SHOWN_S = 0.1
"""Velocities are drawn as the distance of this time."""
SIGMAS = 2.0


class StrikeWriter:
    """Writes each decision at its own time on the robot's clock."""

    def __init__(self, context: Context) -> None:
        self._context = context
        trace = context.trace
        trace.static(entities.PREDICTED_PATH.path, rr.LineStrips3D.from_fields(colors=PREDICTED, radii=0.005))
        trace.static(entities.PREDICTED_BALL.path, rr.Ellipsoids3D.from_fields(colors=PREDICTED))
        trace.static(entities.CHOSEN_HIT.path, rr.Arrows3D.from_fields(colors=CHOSEN, radii=0.01))
        trace.static(entities.OUTGOING.path, rr.Arrows3D.from_fields(colors=LEFT, radii=0.008))
        target = rr.Points3D.from_fields(colors=TARGET, radii=0.07, labels=["target"])
        trace.static(entities.STRIKE_TARGET.path, target)
        trace.static(entities.LANDING.path, rr.Points3D.from_fields(colors=LEFT, radii=0.05, labels=["landed"]))

    def write(self, received: list[Received[m.Strike]]) -> None:
        """Write every decision."""
        for one in received:
            strike = one.message
            row = self._context.row(self._context.runs.tick_at(strike.time), one.wall_ns)
            self._write_event(row, strike)
            self._context.trace.scalars(entities.REVISIONS.path, row, [strike.revisions])
            if strike.prediction is not None:
                self._write_prediction(row, strike.prediction)
            if strike.racket is not None:
                self._write_racket(row, strike.racket)
            if strike.hit is not None and strike.hit.velocity is not None:
                self._write_arrow(entities.OUTGOING.path, row, strike.hit.position, strike.hit.velocity)
            if strike.phase == "landed" and strike.landing is not None:
                self._write_landing(strike.landing, one.wall_ns)

    def _write_event(self, row: Rows, strike: m.Strike) -> None:
        is_correction = strike.phase == "refused" and strike.goal_id is not None  # its swing continues
        if not is_correction:
            self._context.trace.states(entities.STRIKE_LANE.path, row, [f"{strike.ball} {strike.phase}"])
        if strike.phase == "revised":
            return  # up to fifty a second
        said = "goes on uncorrected" if is_correction else strike.phase
        if strike.phase == "landed" and strike.landing is not None:
            said = f"lands at {strike.landing.time:.2f} s, {strike.landing.distance:.2f} m from the target"
        reason = f": {strike.reason}" if strike.reason else ""
        level = "WARN" if strike.phase in ("refused", "missed") and not is_correction else "INFO"
        self._context.event(entities.STRIKE_EVENT, row, f"ball {strike.ball} {said}{reason}", level)

    def _write_prediction(self, row: Rows, prediction: m.BallPrediction) -> None:
        trace = self._context.trace
        trace.scalars(entities.PREDICTION_SPREAD.path, row, np.array([prediction.spread]))
        spread = SIGMAS * np.array([prediction.spread])
        ball = rr.Ellipsoids3D.columns(centers=np.array([prediction.position]), half_sizes=spread)
        trace.send(entities.PREDICTED_BALL.path, row, ball)
        if len(prediction.path) > 1:
            path = rr.LineStrips3D.columns(strips=[np.array(prediction.path)])
            trace.send(entities.PREDICTED_PATH.path, row, path)

    def _write_racket(self, row: Rows, racket: m.RacketAim) -> None:
        self._context.trace.scalars(entities.EXPECTED_ERROR.path, row, [racket.error])
        self._write_arrow(entities.CHOSEN_HIT.path, row, racket.position, racket.velocity)
        target = rr.Points3D.columns(positions=np.array([racket.landing]))
        self._context.trace.send(entities.STRIKE_TARGET.path, row, target)

    def _write_landing(self, landing: m.Landing, wall_ns: int) -> None:
        """Write a landing at its own time; it was predicted from the first measurements after the hit."""
        row = self._context.row(self._context.runs.tick_at(landing.time), wall_ns)
        place = rr.Points3D.columns(positions=np.array([landing.position]))
        self._context.trace.send(entities.LANDING.path, row, place)
        self._context.trace.scalars(entities.LANDING_DISTANCE.path, row, [landing.distance])

    def _write_arrow(
        self, path: str, row: Rows, place: tuple[float, float, float], velocity: tuple[float, float, float]
    ) -> None:
        arrow = rr.Arrows3D.columns(origins=np.array([place]), vectors=SHOWN_S * np.array([velocity]))
        self._context.trace.send(path, row, arrow)
