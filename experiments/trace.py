"""The experiments' curves as one Rerun trace."""

from collections.abc import Iterable
from datetime import timedelta
from pathlib import Path

import numpy as np
import rerun as rr

from experiments.common import Curve


def write_trace(found: Iterable[Curve], path: Path) -> None:
    """Write all curves to `path`, each as an entity on the timeline sim_time."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with rr.RecordingStream("volley-paper") as stream:
        stream.save(path)
        for curve in found:
            times = rr.TimeColumn("sim_time", duration=[timedelta(seconds=float(t)) for t in curve.times])
            stream.send_columns(curve.path, [times], rr.Scalars.columns(scalars=np.asarray(curve.values, dtype=float)))
