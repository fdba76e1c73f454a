"""A movement primitive: what is kept of a demonstration, in normalised time (design 1.1)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy  # whose parts are loaded when they are first used: a planner starts half a second sooner

from motion.basis import INTERVALS, make_grid
from motion.demonstration import Demonstration, SavitzkyGolay, Smoothing, smooth
from motion.errors import InvalidMotion
from motion.request import Boundary

MIN_BASIS, MAX_BASIS = 10, 200


@dataclass(frozen=True, slots=True, eq=False)
class Primitive:
    """A demonstration of J joints in normalised time s = t/duration: all that the planner needs to imitate it.

    duration: T_d, s. theta: (J, N), ∫ψ_i d″ ds with d″ = T_d²·d̈ (eq. 14). positions (rad) and accelerations
    (rad/s²): (1001, J), the smoothed demonstration on the grid s = 0, 0.001, … 1. start, goal: its end states.
    samples: how many were recorded. fit_rms: (J,) rad/s², what the basis cannot follow. noise_estimate: (J,)
    rad. smoothing: the filter used, None for none.
    """

    duration: float
    theta: np.ndarray
    positions: np.ndarray
    accelerations: np.ndarray
    start: Boundary
    goal: Boundary
    samples: int
    fit_rms: np.ndarray
    noise_estimate: np.ndarray
    smoothing: SavitzkyGolay | None

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return len(self.theta)

    @property
    def basis_count(self) -> int:
        """Number of basis functions N."""
        return self.theta.shape[1]

    def demonstrated_positions(self, s: np.ndarray) -> np.ndarray:
        """The demonstrated positions (n, J), rad, at normalised times s (n,) in [0, 1]."""
        grid = np.linspace(0, 1, INTERVALS + 1)
        return np.stack([np.interp(s, grid, column) for column in self.positions.T], axis=1)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """All fields as arrays, for `np.savez`."""
        smoothing = [] if self.smoothing is None else [self.smoothing.window_s, self.smoothing.order]
        ends = [(b.positions, b.velocities, b.accelerations) for b in (self.start, self.goal)]
        return {
            "duration": np.array(self.duration),
            "theta": self.theta,
            "positions": self.positions,
            "accelerations": self.accelerations,
            "ends": np.array(ends),
            "samples": np.array(self.samples),
            "fit_rms": self.fit_rms,
            "noise_estimate": self.noise_estimate,
            "smoothing": np.array(smoothing, dtype=float),
        }

    @staticmethod
    def from_arrays(arrays: Mapping[str, np.ndarray]) -> "Primitive":
        """The primitive that `to_arrays` wrote. Raises InvalidMotion for anything missing or malformed."""
        data = {name: _array(arrays, name) for name in _FIELDS}
        if data["theta"].ndim != 2:
            raise InvalidMotion("theta", f"needs joints × basis functions; it has shape {data['theta'].shape}")
        joints, basis_count = data["theta"].shape
        _check_basis_count(basis_count)
        grid = (INTERVALS + 1, joints)
        shapes = {"duration": (), "samples": (), "positions": grid, "accelerations": grid}
        shapes |= {"ends": (2, 3, joints), "fit_rms": (joints,), "noise_estimate": (joints,)}
        for name, shape in shapes.items():
            if data[name].shape != shape:
                raise InvalidMotion(name, f"needs shape {shape}; it has {data[name].shape}")
        if data["smoothing"].shape not in ((0,), (2,)):
            raise InvalidMotion("smoothing", "needs no number or window and order")
        if data["duration"] <= 0:
            raise InvalidMotion("duration", f"is {data['duration']}; it has to be greater than 0 s")
        window = data["smoothing"]
        smoothing = SavitzkyGolay(float(window[0]), int(window[1])) if window.size else None
        return Primitive(
            duration=float(data["duration"]),
            theta=data["theta"],
            positions=data["positions"],
            accelerations=data["accelerations"],
            start=Boundary(*data["ends"][0]),
            goal=Boundary(*data["ends"][1]),
            samples=int(data["samples"]),
            fit_rms=data["fit_rms"],
            noise_estimate=data["noise_estimate"],
            smoothing=smoothing,
        )


_FIELDS = (
    "duration",
    "theta",
    "positions",
    "accelerations",
    "ends",
    "samples",
    "fit_rms",
    "noise_estimate",
    "smoothing",
)


def learn(demonstration: Demonstration, smoothing: Smoothing = "auto", basis_count: int = 50) -> Primitive:
    """Learn a primitive from one demonstration. Raises InvalidMotion as `smooth` does."""
    _check_basis_count(basis_count)
    grid = make_grid(basis_count)
    smoothed = smooth(demonstration, smoothing)
    duration = float(smoothed.times[-1])
    at = grid.s * duration
    positions = scipy.interpolate.make_interp_spline(smoothed.times, smoothed.positions, k=3)(at)
    accelerations = scipy.interpolate.make_interp_spline(smoothed.times, smoothed.accelerations, k=3)(at)
    psi = grid.basis.rows(grid.s, 0)
    target = duration**2 * accelerations
    theta = np.asarray(scipy.integrate.simpson(psi[:, :, None] * target[:, None, :], x=grid.s, axis=0))
    fitted = psi @ grid.whitening.T @ grid.whiten(theta.T).T
    residual = (fitted - target) / duration**2
    first, last = (Boundary(smoothed.positions[i], smoothed.velocities[i], smoothed.accelerations[i]) for i in (0, -1))
    return Primitive(
        duration=duration,
        theta=np.ascontiguousarray(theta.T),
        positions=positions,
        accelerations=accelerations,
        start=first,
        goal=last,
        samples=len(demonstration.times),
        fit_rms=np.sqrt(np.asarray(scipy.integrate.simpson(residual**2, x=grid.s, axis=0))),
        noise_estimate=smoothed.noise_estimate,
        smoothing=smoothed.smoothing,
    )


def _check_basis_count(count: int) -> None:
    if not MIN_BASIS <= count <= MAX_BASIS:
        raise InvalidMotion("basis_count", f"is {count}; it has to be from {MIN_BASIS} to {MAX_BASIS}")


def _array(arrays: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    if name not in arrays:
        raise InvalidMotion(name, "is missing")
    values = np.array(arrays[name], dtype=float)
    if not np.isfinite(values).all():
        raise InvalidMotion(name, "has to be finite")
    return values
