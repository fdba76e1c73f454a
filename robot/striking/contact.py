"""The contact law: velocities of a ball after a hit, with the recoil of the arm.

With w = v − u the velocity of the ball relative to the racket, n the racket's normal on the ball's side and C = J M⁻¹
Jᵀ + I/m_b, the impulse on the ball is C⁻¹(−(1+e) w_n n − (1−κ) w_t). See docs/striking.md.
"""

from dataclasses import dataclass, field

import numpy as np

ROUNDS = 2
"""Iterations for a normal; a tangential velocity of the racket compensates the remaining error."""


@dataclass(frozen=True, slots=True, eq=False)
class ContactLaw:
    """Restitution e, friction κ (part of the tangential velocity that is kept), duration of the contact, s.

    bias: (3,), m/s, added to the outgoing velocity in the axes of `frame`. Arguments of all methods: the ball's mass,
    kg, the mobility (n, 3, 3), velocities of the ball and the racket (n, 3), m/s, and the racket's normals (n, 3).
    """

    restitution: float
    friction: float
    duration: float = 0.0
    bias: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def outgoing(
        self, mass: float, mobility: np.ndarray, incoming: np.ndarray, racket: np.ndarray, normals: np.ndarray
    ) -> np.ndarray:
        """Return the velocities (n, 3) of balls after the hit."""
        along, across = components(incoming - racket, normals)
        change = -(1 + self.restitution) * along - (1 - self.friction) * across
        impulse = np.linalg.solve(mobility, change[:, :, None])[:, :, 0]
        return incoming + impulse / mass + (frame(normals) @ self.bias)

    def derivatives(
        self, mass: float, mobility: np.ndarray, incoming: np.ndarray, racket: np.ndarray, normals: np.ndarray
    ) -> np.ndarray:
        """Return the derivatives of the outgoing velocities by restitution, friction and bias, (n, 3, 5)."""
        along, across = components(incoming - racket, normals)
        sides = np.stack([-along, across], axis=2)
        return np.concatenate([np.linalg.solve(mobility, sides) / mass, frame(normals)], axis=2)

    def better_normal(
        self, mass: float, mobility: np.ndarray, incoming: np.ndarray, wanted: np.ndarray, normals: np.ndarray
    ) -> np.ndarray:
        """Return normals (n, 3) with which a racket that moves only along them gives the wanted velocities."""
        for _ in range(ROUNDS):
            change = self._change(mass, mobility, incoming, wanted, normals)
            change = change + (1 - self.friction) * components(incoming, normals)[1]
            normals = change / np.linalg.norm(change, axis=1, keepdims=True)
        return normals

    def racket_velocity(
        self, mass: float, mobility: np.ndarray, incoming: np.ndarray, wanted: np.ndarray, normals: np.ndarray
    ) -> np.ndarray:
        """Return the velocities (n, 3) of a racket with these normals that give exactly the wanted velocities."""
        along, across = components(self._change(mass, mobility, incoming, wanted, normals), normals)
        return incoming + along / (1 + self.restitution) + across / max(1 - self.friction, 0.02)

    def _change(
        self, mass: float, mobility: np.ndarray, incoming: np.ndarray, wanted: np.ndarray, normals: np.ndarray
    ) -> np.ndarray:
        """Return the changes (n, 3) of the relative velocities of ball and racket."""
        return mass * (mobility @ (wanted - frame(normals) @ self.bias - incoming)[:, :, None])[:, :, 0]


def frame(normals: np.ndarray) -> np.ndarray:
    """Return matrices (n, 3, 3) with the columns: normal, horizontal tangent, upward tangent."""
    x, y, z = normals.T
    level = np.sqrt(x * x + y * y)
    slanted = level > 1e-6
    level = np.maximum(level, 1e-9)
    i, j = np.where(slanted, -y / level, 0.0), np.where(slanted, x / level, 1.0)
    found = np.empty((len(normals), 3, 3))
    found[:, :, 0] = normals
    found[:, 0, 1], found[:, 1, 1], found[:, 2, 1] = i, j, 0.0
    found[:, 0, 2], found[:, 1, 2], found[:, 2, 2] = -z * j, z * i, x * j - y * i
    return found


def components(vectors: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the components of vectors (n, 3) along the normals (n, 3) and perpendicular to them."""
    along = np.vecdot(vectors, normals)[:, None] * normals
    return along, vectors - along


def first_normal(incoming: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return the normals (n, 3) of a racket without mobility and friction."""
    change = wanted - incoming
    return change / np.linalg.norm(change, axis=1, keepdims=True)
