"""Pure mathematics of movement: arrays in, arrays out; no clock, bus, file or MuJoCo.

For callers: `demonstration` and `primitive` (learning), `limits` and `request` (the request of a motion), `plan` and
`alternatives` (planning), `gaussian` and `dmp_plan` (methods for comparison), `trajectory`, `braking`, `tracking`,
`errors`. `program/` is the implementation of the quadratic program.
"""
