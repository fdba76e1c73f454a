"""The requests of the wire contract as methods, each written once for both kinds of arm."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar, Unpack

from msgspec.structs import replace

from client.fields import GoalFields, Vector
from client.handles import GoalBase, MotionBase
from client.link import Link
from client.results import Results
from client.simulation import SimulationRequests
from client.striking import StrikingRequests
from client.sync_or_async import SyncOrAsync
from client.trajectories import executable
from protocol import messages as m
from protocol import topics
from protocol.codec import matrix_bytes

if TYPE_CHECKING:
    import numpy as np

GoalT = TypeVar("GoalT", bound=GoalBase)
MotionT = TypeVar("MotionT", bound=MotionBase)


class Requests(SimulationRequests, StrikingRequests, Generic[GoalT, MotionT]):
    """Requests to a robot, shared by `Arm` and `AsyncArm`."""

    def __init__(self, link: Link, goal: type[GoalT], motion: type[MotionT]) -> None:
        super().__init__(link)
        self._results = Results(link)
        self._goal_handle = goal
        self._motion_handle = motion

    @property
    def holds_lease(self) -> bool:
        """Whether this connection is inside a `lease` block."""
        return self._link.leased

    @SyncOrAsync
    async def robots(self) -> list[str]:
        """Return the sorted names of the robots on this bus; empty if the router does not reply."""
        return sorted({robot for robot, _ in await self._link.alive()})

    # --- motions --------------------------------------------------------------------------------------

    @SyncOrAsync
    async def goal(self, primitive: str, **fields: Unpack[GoalFields]) -> GoalT:
        """Plan and play a motion, and return a handle that waits for its end, stops it or corrects it.

        Without fields, the motion imitates the demonstration to its own end, starting from the reference trajectory.

        Args:
            primitive: Primitive to imitate; `primitives` lists them.
            fields: See `GoalFields`.
        """
        return await self._send(primitive, fields)

    @SyncOrAsync
    async def plan(self, primitive: str, **fields: Unpack[GoalFields]) -> m.GoalReply:
        """Plan a motion without playing it, and return the plan with its report.

        Args:
            primitive: Primitive to imitate.
            fields: See `GoalFields`. With `include_trajectory` the reply has samples, and polynomials too if the plan
                is longer than 20 s.
        """
        return await self._link.ask(topics.GOAL, self._message(primitive, fields, plan_only=True))

    @SyncOrAsync
    async def execute(self, motion: m.GoalReply | m.Trajectory, lead: float | None = None) -> MotionT:
        """Play a planned trajectory, or one of your own.

        The arm must be at the trajectory's start, at rest or in the motion from which it was planned. The controller
        refuses a trajectory that exceeds a limit.

        Args:
            motion: The reply of `plan` with `include_trajectory`, or a trajectory.
            lead: Start this long from now, s, instead of at the trajectory's `start_time`.

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

    @SyncOrAsync
    async def cancel(self, goal_id: str | None = None) -> m.Canceled:
        """Stop the arm inside its limits.

        Args:
            goal_id: Stop only this motion; by default any.
        """
        return await self._link.ask(topics.CANCEL, m.Cancel(goal_id=goal_id))

    @SyncOrAsync
    async def reset(self) -> m.ModeReply:
        """Leave a latched fault; the arm must be at rest."""
        return await self._link.ask(topics.RESET, m.Empty())

    @SyncOrAsync
    async def recover(self) -> m.Recovered:
        """Make the arm ready again after a reflex, a stop or braking; a new run begins at its present pose."""
        return await self._link.ask(topics.RECOVER, m.Empty())

    @SyncOrAsync
    async def hold(self, joints: Mapping[str, float]) -> m.Held:
        """Move held joints, for example of a gripper, to new values: rad or m, by joint name."""
        return await self._link.ask(topics.HOLD, m.Hold(joints=dict(joints)))

    @SyncOrAsync
    async def guide(self) -> m.Guided:
        """Let the arm be guided by hand, weightless and compliant, until `recover`; refused while it moves."""
        return await self._link.ask(topics.GUIDE, m.Empty())

    @SyncOrAsync
    async def result(self, goal_id: str) -> m.Result:
        """Return the result of a goal, also while it runs."""
        return await self._link.ask(topics.RESULT, m.ResultRequest(goal_id=goal_id))

    @contextmanager
    def lease(self) -> Iterator[str]:
        """Hold a lease on the arm for a `with` block, and return the client's id.

        While a motion sent inside the block runs, goals and trajectories of all other clients are refused as
        `not_holder`. When the block ends, or this process dies, a running motion is stopped; of blocks at once, inside
        each other or in several threads, the last one ends the lease. Use a plain `with`, also for an `AsyncArm`.
        """
        with self._link.lease() as client_id:
            yield client_id

    # --- primitives -----------------------------------------------------------------------------------

    @SyncOrAsync
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
        """Learn a primitive from a demonstration, and return the errors of the fit, with warnings.

        Args:
            name: 1 to 64 letters, digits, - or _, the first a letter or digit.
            positions: (N, J), rad: 10 to 100,000 samples of J joints.
            rate: Samples a second; give this or `times`.
            times: (N,), s, not decreasing; samples with the same time are averaged.
            joint_names: Names of the columns, in any order; by default the arm's joints, in its order.
            smoothing: `auto` estimates each joint's smoothing; `none` follows every sample; or a Savitzky-Golay filter.
            replace: Overwrite a primitive of this name; False refuses it as `exists`.
            spread: (P, J), rad, at 2 to 1001 even times: standard deviation of several recordings around this one,
                their mean. Motions stay close to it where the spread is small.

        Raises:
            ValueError: `positions` is not a matrix.
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

    @SyncOrAsync
    async def primitives(self) -> list[m.PrimitiveEntry]:
        """Return the library, by name."""
        return (await self._link.ask(topics.PRIMITIVES, m.Empty())).primitives

    @SyncOrAsync
    async def forget(self, name: str) -> m.Forgotten:
        """Remove a primitive from the library."""
        return await self._link.ask(topics.FORGET, m.Forget(name=name))

    # --- what the arm is and does ---------------------------------------------------------------------

    @SyncOrAsync
    async def description(self) -> m.Description:
        """Return the arm's joints, home, limits and clock."""
        return await self._link.ask(topics.DESCRIPTION, m.Empty())

    @SyncOrAsync
    async def state(self) -> m.State:
        """Return the newest measured state."""
        return await self._link.ask(topics.STATE_QUERY, m.Empty())

    @SyncOrAsync
    async def status(self) -> m.Status:
        """Return the controller's mode, goal, reference, errors and timing."""
        return await self._link.ask(topics.STATUS_QUERY, m.Empty())

    @SyncOrAsync
    async def reference(self, lead: float = 0.0) -> m.Reference:
        """Return the state of the reference trajectory, of all motions accepted so far.

        Args:
            lead: Time ahead of now, s.
        """
        return await self._link.ask(topics.REFERENCE, m.ReferenceRequest(lead=lead))

    async def _send(self, primitive: str, fields: GoalFields) -> GoalT:
        """Send a goal and return the handle of its motion."""
        goal = self._message(primitive, fields)
        self._results.expect(goal.goal_id)
        reply = await self._link.ask(topics.GOAL, goal)
        return self._goal_handle(self._link, self._results, self._send, primitive, reply)

    def _message(self, primitive: str, fields: GoalFields, plan_only: bool = False) -> m.Goal:
        whose: dict[str, Any] = {"client_id": self._link.client_id, "lease": self._link.leased and not plan_only}
        given: dict[str, Any] = dict(fields)
        return m.Goal(primitive=primitive, plan_only=plan_only, **whose, **given)
