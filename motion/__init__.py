"""Pure mathematics of movement: arrays in, arrays out; no clock, bus, file or MuJoCo.

What a caller needs: `demonstration` and `primitive` (learning), `limits` and `request` (what is asked), `plan` and
`alternatives` (planning), `gaussian` and `dmp_plan` (the methods it is compared with), `trajectory`, `braking`,
`tracking`, `errors`. `program/` is the quadratic program's inside.
"""
