"""The requests of the wire contract as methods, each written once for both kinds of arm."""

from __future__ import annotations

import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar, Unpack

from msgspec.structs import replace

from client.fields import GoalFields, Vector
from client.handles import Correcting, Following
from client.link import Link
from client.results import Results
from client.simulation import SimulationRequests
from client.striking import StrikingRequests
from client.trajectories import executable
from client.twofold import Twofold
from protocol import messages as m
from protocol import topics
from protocol.codec import matrix_bytes

if TYPE_CHECKING:
    import numpy as np

GoalT = TypeVar("GoalT", bound=Correcting)
MotionT = TypeVar("MotionT", bound=Following)


class Requests(SimulationRequests, StrikingRequests, Generic[GoalT, MotionT]):
    """What can be asked of a robot: what `Arm` and `AsyncArm` have in common."""

    def __init__(self, link: Link, goal: type[GoalT], motion: type[MotionT]) -> None:
        super().__init__(link)
        self._results = Results(link)
        self._goal_handle = goal
        self._motion_handle = motion

    @property
    def holds_lease(self) -> bool:
        """Whether this connection is in the block of a `lease`."""
        return self._link.leased

    @Twofold
    async def robots(self) -> list[str]:
        """Return the names of the robots on this bus, sorted; none where the router is silent."""
        return sorted({robot for robot, _ in await self._link.alive()})

    # --- motions --------------------------------------------------------------------------------------

    @Twofold
    async def goal(self, primitive: str, **fields: Unpack[GoalFields]) -> GoalT:
        """Plan a motion, play it, and return a handle to wait for its end, stop it or correct it.

        With no fields the demonstration is played to its own end, from where the arm will be.

        Args:
            primitive: What to imitate; `primitives` lists them.
            fields: See `GoalFields`.
        """
        return await self._send(primitive, fields)

    @Twofold
    async def plan(self, primitive: str, **fields: Unpack[GoalFields]) -> m.GoalReply:
        """Plan a motion without playing it, and return the plan with its report.

        Args:
            primitive: What to imitate.
            fields: See `GoalFields`; with `include_trajectory` the reply has samples, over 20 s polynomials too.
        """
        return await self._link.ask(topics.GOAL, self._message(primitive, fields, plan_only=True))

    @Twofold
    async def execute(self, motion: m.GoalReply | m.Trajectory, lead: float | None = None) -> MotionT:
        """Play a trajectory that was planned before, or that is your own.

        The arm must be where the trajectory begins, at rest or in the motion that it was planned from. The controller
        checks its limits and refuses it where it would pass one.

        Args:
            motion: The reply of `plan` with `include_trajectory`, or a trajectory.
            lead: Start this long from now, s, instead of at the trajectory's own `start_time`.

        Raises:
            ValueError: the reply has no trajectory.
        """
        if isinstance(motion, m.GoalReply):
            rate_hz = (await self._link.ask(topics.DESCRIPTION, m.Empty())).rate_hz
            motion = executable(motion, rate_hz)
        if lead is not None:
            now = await self._link.ask(topics.REFERENCE, m.ReferenceRequest(lead=lead))
            motion = replace(motion, start_time=now.time, epoch=now.epoch)
        if self._link.leased:
            motion = replace(motion, client_id=self._link.client_id, lease=True)
        self._results.expect(motion.goal_id)
        accepted = await self._link.ask(topics.EXECUTE, motion)
        return self._motion_handle(self._link, self._results, accepted.goal_id, accepted.start_time)

    @Twofold
    async def cancel(self, goal_id: str | None = None) -> m.Canceled:
        """Stop the arm inside its limits.

        Args:
            goal_id: Stop only this motion; by default whatever moves.
        """
        return await self._link.ask(topics.CANCEL, m.Cancel(goal_id=goal_id))

    @Twofold
    async def reset(self) -> m.ModeReply:
        """Leave a latched fault; the arm must be at rest."""
        return await self._link.ask(topics.RESET, m.Empty())

    @Twofold
    async def recover(self) -> m.Recovered:
        """Make the arm ready again after a reflex, a stop or its own brake; a new run begins where it stands."""
        return await self._link.ask(topics.RECOVER, m.Empty())

    @Twofold
    async def hold(self, joints: Mapping[str, float]) -> m.Held:
        """Lead held joints, as those of a gripper, to new values: rad or m by name."""
        return await self._link.ask(topics.HOLD, m.Hold(joints=dict(joints)))

    @Twofold
    async def guide(self) -> m.Guided:
        """Let the arm be guided by hand, weightless and compliant, until `recover`; refused while it moves."""
        return await self._link.ask(topics.GUIDE, m.Empty())

    @Twofold
    async def result(self, goal_id: str) -> m.Result:
        """Return how a goal goes or went."""
        return await self._link.ask(topics.RESULT, m.ResultRequest(goal_id=goal_id))

    @contextmanager
    def lease(self) -> Iterator[str]:
        """Hold the arm for the length of a `with` block, and return the client's id.

        Goals and trajectories sent inside the block move the arm for this client alone: others are refused with
        `not_holder` until the motion has ended. When the block is left, or this process dies, what still moves is
        stopped. For an `AsyncArm` too this is a plain `with`.
        """
        link = self._link
        link.client_id = link.client_id or f"client-{uuid.uuid4().hex[:8]}"
        token = link.bus.announce(f"client/{link.client_id}")
        link.leased = True
        try:
            yield link.client_id
        finally:
            link.leased = False
            token.undeclare()

    # --- primitives -----------------------------------------------------------------------------------

    @Twofold
    async def learn(
        self,
        name: str,
        positions: np.ndarray | Sequence[Sequence[float]],
        *,
        rate: float | None = None,
        times: Vector | None = None,
        joint_names: Sequence[str] | None = None,
        smoothing: Literal["auto", "none"] | m.SavitzkyGolay = "auto",
        replace: bool = False,
        spread: np.ndarray | None = None,
    ) -> m.Learned:
        """Learn a primitive from a demonstration, and return how well it was learned, with warnings.

        Args:
            name: 1 to 64 letters, digits, - or _, the first a letter or digit.
            positions: (N, J), rad: 10 to 100,000 samples of J joints.
            rate: Samples a second; this or `times`.
            times: (N,), s, not falling; of samples with one time the mean is learned.
            joint_names: Of the columns, in any order; by default the arm's own, in its order.
            smoothing: `auto` smooths each joint as its noise asks for; `none` follows every sample; or this filter.
            replace: Overwrite a primitive of this name; False refuses it as `exists`.
            spread: (P, J), rad, at 2 to 1001 even times: how far several recordings spread around this one, their mean.
                Motions stay near the places where it is small.

        Raises:
            ValueError: `positions` is no matrix.
        """
        import numpy as np

        matrix = np.asarray(positions, dtype=float)
        if matrix.ndim != 2:
            raise ValueError(f"positions has the shape {matrix.shape}; it must be samples × joints")
        request = m.Learn(
            name=name,
            positions=matrix_bytes(matrix),
            joint_count=matrix.shape[1],
            joint_names=None if joint_names is None else list(joint_names),
            rate=rate,
            times=None if times is None else list(times),
            smoothing=smoothing,
            replace=replace,
            spread=None if spread is None else spread.tolist(),
        )
        return await self._link.ask(topics.LEARN, request)

    @Twofold
    async def primitives(self) -> list[m.PrimitiveEntry]:
        """Return the library, by name."""
        return (await self._link.ask(topics.PRIMITIVES, m.Empty())).primitives

    @Twofold
    async def forget(self, name: str) -> m.Forgotten:
        """Remove a primitive from the library."""
        return await self._link.ask(topics.FORGET, m.Forget(name=name))

    # --- what the arm is and does ---------------------------------------------------------------------

    @Twofold
    async def description(self) -> m.Description:
        """Return what the arm is: joints, home, limits, clock."""
        return await self._link.ask(topics.DESCRIPTION, m.Empty())

    @Twofold
    async def state(self) -> m.State:
        """Return what the arm measured last."""
        return await self._link.ask(topics.STATE_QUERY, m.Empty())

    @Twofold
    async def status(self) -> m.Status:
        """Return the controller at a glance: mode, goal, reference, errors, how well it keeps time."""
        return await self._link.ask(topics.STATUS_QUERY, m.Empty())

    @Twofold
    async def reference(self, lead: float = 0.0) -> m.Reference:
        """Return where everything accepted so far will have the arm.

        Args:
            lead: From now, s.
        """
        return await self._link.ask(topics.REFERENCE, m.ReferenceRequest(lead=lead))

    async def _send(self, primitive: str, fields: GoalFields) -> GoalT:
        """Send a goal to be played and return its handle."""
        goal = self._message(primitive, fields)
        self._results.expect(goal.goal_id)
        reply = await self._link.ask(topics.GOAL, goal)
        return self._goal_handle(self._link, self._results, self._send, primitive, reply)

    def _message(self, primitive: str, fields: GoalFields, plan_only: bool = False) -> m.Goal:
        whose: dict[str, Any] = {"client_id": self._link.client_id, "lease": self._link.leased and not plan_only}
        given: dict[str, Any] = dict(fields)
        return m.Goal(primitive=primitive, plan_only=plan_only, **whose, **given)
