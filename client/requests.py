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
from client.trajectories import executable
from client.waiting import Twofold
from protocol import messages as m
from protocol import topics
from protocol.bus.bus import Bus
from protocol.codec import matrix_bytes
from protocol.topics import Query, ReplyT, RequestT

if TYPE_CHECKING:
    import numpy as np

GoalT = TypeVar("GoalT", bound=Correcting)
MotionT = TypeVar("MotionT", bound=Following)


class Requests(Generic[GoalT, MotionT]):
    """What can be asked of a robot: what `Arm` and `AsyncArm` have in common.

    Every method raises `Refusal` where the request is refused, with a `code`, a sentence and a `detail`, and `NoAnswer`
    where nobody answers. A refused request changes nothing.
    """

    def __init__(self, link: Link, goal: type[GoalT], motion: type[MotionT]) -> None:
        self._link = link
        self._results = Results(link)
        self._goal_handle = goal
        self._motion_handle = motion

    @property
    def bus(self) -> Bus:
        """The bus underneath: its session, and who is alive on it."""
        return self._link.bus

    @property
    def holds_lease(self) -> bool:
        """Whether this connection is in the block of a `lease`."""
        return self._link.leased

    @Twofold
    async def ask(self, topic: Query[RequestT, ReplyT], request: RequestT) -> ReplyT:
        """Send any request of `protocol.topics` and return its reply; the other methods are built on this one."""
        return await self._link.ask(topic, request)

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
            fields: See `GoalFields`; with `include_trajectory` the reply has samples and polynomials.
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

    # --- strikes ------------------------------------------------------------------------------------------

    @Twofold
    async def strike(
        self,
        target: Vector,
        *,
        flight_time: float | None = None,
        count: int | None = None,
        primitives: Sequence[str] | None = None,
        revise_hz: float = 50.0,
        until_s: float = 0.05,
    ) -> m.Striking:
        """Let the striker return every ball that comes within reach; `stream(topics.STRIKES)` says what it does.

        A further call replaces the one before; for a ball on its way it moves the target.

        Args:
            target: Where the balls shall land, (3,), m, in the world frame.
            flight_time: From the touch to the landing, s; by default the striker chooses it.
            count: Balls to strike at; by default without end.
            primitives: Those that may be imitated; by default any of the library.
            revise_hz: Corrections a second while the arm swings; 0: none.
            until_s: Time before the touch after which nothing is corrected, s.

        Raises:
            ValueError: the target has not three numbers.
        """
        request = m.StrikeRequest(
            target=_triple("target", target),
            flight_time=flight_time,
            count=count,
            primitives=None if primitives is None else list(primitives),
            revise_hz=revise_hz,
            until_s=until_s,
        )
        return await self._link.ask(topics.STRIKE, request)

    @Twofold
    async def stop_striking(self) -> m.Striking:
        """Strike at no further ball; a motion under way is played to its end."""
        return await self._link.ask(topics.STRIKE_STOP, m.Empty())

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
            name: 1 to 64 letters, digits, - or _.
            positions: (N, J), rad: 10 to 100,000 samples of J joints.
            rate: Samples a second; this or `times`.
            times: (N,), s, rising.
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

    # --- the simulated arm ----------------------------------------------------------------------------

    @Twofold
    async def step(self, ticks: int = 1) -> m.Stepped:
        """Advance the stepped clock.

        Args:
            ticks: 1 to 10000.
        """
        return await self._link.ask(topics.SIM_STEP, m.Step(ticks=ticks))

    @Twofold
    async def reset_sim(
        self, positions: Vector | None = None, ball: m.Ball | None = None, seed: int = 0
    ) -> m.ResetDone:
        """Begin a new run of the simulated arm: at rest, the clock at 0.

        Args:
            positions: Where the arm begins, rad a joint; by default home.
            ball: Where the ball begins; by default on its tee.
            seed: Of the sensor noise; names the run where the clock is stepped.
        """
        return await self._link.ask(topics.SIM_RESET, m.Reset(positions=_listed(positions), ball=ball, seed=seed))

    @Twofold
    async def throw(self, position: Vector, velocity: Vector, spin: Vector | None = None) -> m.Thrown:
        """Put the simulated ball in flight, in the run that goes on.

        Args:
            position: (3,), m, in the world frame.
            velocity: (3,), m/s.
            spin: Angular velocity (3,), rad/s; by default none.

        Raises:
            ValueError: a vector has not three numbers.
        """
        turning = None if spin is None else _triple("spin", spin)
        throw = m.Throw(position=_triple("position", position), velocity=_triple("velocity", velocity), spin=turning)
        return await self._link.ask(topics.SIM_BALL, throw)

    @Twofold
    async def disturb(
        self,
        kind: Literal["acceleration", "torque", "sensor_noise", "ball_noise", "loss"],
        *,
        values: Vector | None = None,
        start_time: float | None = None,
        duration: float | None = None,
        position_std: float | None = None,
        velocity_std: float | None = None,
        stream: Literal["state", "command"] | None = None,
        latency_s: float | None = None,
        drop_rate: float | None = None,
    ) -> m.Disturbed:
        """Push the simulated arm, blur its sensors or the sight of the ball, or lose messages.

        Args:
            kind: A push by `acceleration` or `torque` needs values and duration; `sensor_noise` both standard
                deviations; `ball_noise` the first, the latency and the drop rate; `loss` stream and duration.
            values: On each joint, rad/s² or N·m.
            start_time: When a push begins, s on the robot's clock; by default now.
            duration: Of a push or a loss, s.
            position_std: Standard deviation of measured positions, rad; of the ball's, m.
            velocity_std: Standard deviation of measured velocities, rad/s.
            stream: Whose messages are lost.
            latency_s: From a sight of the ball to its message, s.
            drop_rate: Part of the sights of the ball that are lost, 0 to 1.
        """
        push = {"values": _listed(values), "start_time": start_time, "duration": duration}
        noise = {"position_std": position_std, "velocity_std": velocity_std}
        noise |= {"latency_s": latency_s, "drop_rate": drop_rate}
        request: dict[str, Any] = {"kind": kind, **push, **noise, "stream": stream}
        return await self._link.ask(topics.SIM_DISTURB, m.Disturb(**request))

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


def _listed(values: Vector | None) -> list[float] | None:
    return None if values is None else list(values)


def _triple(name: str, vector: Vector) -> tuple[float, float, float]:
    values = [float(value) for value in vector]
    if len(values) != 3:
        raise ValueError(f"{name} has {len(values)} numbers; a vector in space has 3")
    return values[0], values[1], values[2]
