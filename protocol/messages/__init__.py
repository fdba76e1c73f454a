"""The messages of the wire contract, version 1.

Units are SI throughout: rad, rad/s, rad/s², rad/s³, s, N·m, m, m/s, N·s. Vectors over joints are lists in
the order of `joint_names`. Matrices and arrays are `bytes`: little-endian float64, the last index fastest. Unknown
fields of requests are refused. Publications and replies may gain fields, so readers must ignore unknown fields.
"""

from protocol.messages.arm import *
from protocol.messages.base import *
from protocol.messages.control import *
from protocol.messages.goals import *
from protocol.messages.primitives import *
from protocol.messages.reports import *
from protocol.messages.scene import *
from protocol.messages.simulation import *
from protocol.messages.strikes import *
from protocol.messages.trajectories import *
