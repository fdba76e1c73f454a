"""`python -m services.recorder`: write all publications to a trace, show them live, or both."""

import logging
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Annotated

import tyro

from protocol.bus.bus import Bus
from protocol.bus.sessions import RECORDER
from robot.description import RobotConfig
from services.common import realtime
from services.common.cli import MISUSED, Common, Options, RecorderFlags
from services.common.single_instance import SingleInstance
from services.common.startup import start_beside_loops
from services.recorder.blueprint import build_blueprint
from services.recorder.recorder import Recorder
from services.recorder.validation import listen
from services.recorder.writer import Live, TraceWriter


@dataclass(frozen=True, slots=True)
class Flags:
    """Write all publications of the bus to a Rerun trace."""

    common: Common = field(default_factory=Options)
    own: Annotated[RecorderFlags, tyro.conf.arg(name="")] = field(default_factory=RecorderFlags)


def main() -> None:
    """Run until SIGTERM or Ctrl-C, and exit with the `Outcome` of the instance."""
    flags = tyro.cli(Flags)
    log, stopping, config = start_beside_loops("recorder", flags.common)
    file = flags.own.record
    if file and not file.parent.is_dir():
        log.error("--record %s: there is no directory %s", file, file.parent)
        raise SystemExit(MISUSED)
    realtime.become_nice(realtime.STEADY_NICE)
    instance = SingleInstance("recorder", flags.common, config.name, log, timeouts=RECORDER)

    def serve(bus: Bus) -> None:
        trace = open_trace(flags.own, config, log)
        try:
            recorder = Recorder(config, trace, listen(bus), log)
            bus.announce("recorder")
            recorder.run(stopping)
        finally:
            trace.close()

    raise SystemExit(instance.run(serve, stopping))


def open_trace(flags: RecorderFlags, config: RobotConfig, log: logging.Logger) -> TraceWriter:
    """Open the trace that the flags ask for, and log where it is."""
    file = flags.record
    if file is None and not flags.live:
        file = Path(f"volley-{datetime.now():%Y%m%d-%H%M%S}.rrd")
    live = Live(flags.live_port) if flags.live else None
    trace = TraceWriter(build_blueprint(config, live=live is not None), file, live, index=not flags.unindexed)
    if file:
        log.info("writes %s; open it with: rerun %s", file, file)
    if live:
        log.info("serves a live view; open it with: rerun %s", live.uri)
        log.info("or in a browser: rerun --web-viewer --bind 127.0.0.1 %s", live.uri)
    return trace


if __name__ == "__main__":
    main()
