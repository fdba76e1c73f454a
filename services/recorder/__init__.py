"""The recorder: one process that writes everything said on the bus into a Rerun trace, and may show it live.

Timelines: `sim_time` (duration), `tick` (sequence), `wall` (when the hub had it). Ticks of the arm begin at 0
in each run; in the trace each further run is laid behind the one before, so that neither `tick` nor `sim_time` ever
goes back. The tick at which a run's tick 0 lies is its offset, 0 for the first; `/events/run` tells it in words and
`/runs` in numbers: subtract it to have the numbers of the messages.

Scalars are float64, exactly as the messages had them. Vectors over joints are one entity for each joint, or one entity
of J scalars where the row says (J). What is not said to be a plan's is on all three timelines; a plan's curves,
which have no wall time, are on two. A plan's curves grow as time passes, so that what a later
plan replaced is not drawn. Where a correction takes over the curves have a gap of one tick.

| entity | from | holds |
|---|---|---|
| /joints/NAME/position/measured, /velocity/measured | state | rad, rad/s |
| /joints/NAME/position/true, /velocity/true | state | the same, free of sensor noise, where the arm knows it |
| /joints/NAME/torque | state | N·m |
| /joints/NAME/position/reference, /velocity/reference | command | rad, rad/s |
| /joints/NAME/acceleration/commanded | command | rad/s² |
| /joints/NAME/error | both | measured less reference of the same tick, rad |
| /joints/NAME/{position,velocity,acceleration}/planned | plan | rad, rad/s, rad/s² |
| /joints/NAME/position/demonstrated | plan | the demonstration, warped to the duration, rad |
| /joints/NAME/position/target | plan | goal and waypoints, rad |
| /joints/NAME/position/corrected | plan | where a correction takes over from the plan that it corrects, rad |
| /joints/NAME/{position,velocity,acceleration}/limits | plan, robot | [lowest, highest] in force |
| /joints/NAME/disturbance/{acceleration,torque} | disturbance | sum of what acts, rad/s², N·m |
| /arm/applied_tick, /arm/saturated (J), /arm/brake | state | tick as in the message; 0 or 1 |
| /runs | state, command | run, tick_offset, time_offset (s), integers as such |
| /plans | plan | goal_id, primitive, start_time as in the message, epoch, revises (empty for none), phase |
| /goals | ended | goal_id, outcome, reason, stamps (Unix ns), peak_tracking_error |
| /goals/refused | refused | goal_id (empty for none), client_id, primitive, code, requested (Unix ns) |
| /goals/position_error, /goals/velocity_error (J) | ended | at the hit, placed at the time of the hit |
| /timing/on_time_ratio, /late_us (p50, p99, max), /missed, /count, /refused | status | the controller's loop |
| /timing/error/position, /timing/error/velocity (J) | status | the controller's own tracking error |
| /ball/position, /ball/velocity (3) | ball | m, m/s |
| /contacts | contact | impulse, N·s |
| /lanes/{mode,goal,disturbance,brake} | status, command, disturbance, state | states as coloured lanes |
| /events/{run,goal,contact,controller,disturbance,recorder} | all | sentences |
| /recorder/{states_missing,commands_missing,messages_malformed} | recorder | so far: gaps in ticks, unreadable bodies |
| /world/BODY | state, ball | pose at 100 Hz; below it the body's geometry |
| /world/trail, /world/plan/{path,demonstration,hit} | state, plan | racket's centre, past, planned, demonstrated |
| /world/BODY/push | disturbance | an arrow on the link while a push acts on its joint |
"""
