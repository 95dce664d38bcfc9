"""The command `tessera-record`, also `python -m tessera.record`."""

from __future__ import annotations

import argparse
import math
import os
import signal
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, wait

from tessera.client import Client
from tessera.errors import TesseraError
from tessera.position import Sector
from tessera.record.recorder import EVERY_MAX, Recorder

SIGNAL_LATE_S = 0.2
"""Python handles a signal that comes just before the main thread begins to wait only when that wait ends."""

EXAMPLE = """\
example:
  tessera up --servers 2 &
  tessera load worlds/falling.sdf && tessera resume
  tessera-record --output run.mcap --seconds 2

The file opens in Foxglove and PlotJuggler; tessera.record.read() reads it in Python.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Records until the given end, or until SIGINT or SIGTERM. The exit code: 0, or 1 after an error."""
    options = _parse(arguments)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with Client(options.connect) as client, Recorder(
            client, options.output, every=options.every, bodies=options.bodies, sector=options.sector
        ) as recorder:
            _record(recorder, options)
    except (TesseraError, OSError) as error:
        print(f"tessera-record: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 1
    print(f"recorded {recorder.count} ticks, {os.path.getsize(options.output) / 1e6:.1f} MB")
    return 0


def _record(recorder: Recorder, options: argparse.Namespace) -> None:
    """Handles signals on a separate thread, so that no operation is interrupted."""
    ticks = options.ticks
    if options.seconds is not None:
        ticks = math.ceil(options.seconds / recorder.time_step)
    with ThreadPoolExecutor(1) as executor:
        try:
            following = executor.submit(_follow, recorder, ticks)
            print(f"recording {recorder.world} to {options.output}; Ctrl-C ends it", flush=True)
            while not wait([following], SIGNAL_LATE_S).done:
                pass
            following.result()
        except KeyboardInterrupt:
            recorder.stop()


def _follow(recorder: Recorder, ticks: int | None) -> None:
    """Prints the progress on a terminal, once a second of simulated time."""
    said = -1
    for tick in recorder.follow(ticks):
        second = int(tick * recorder.time_step)
        if second > said and sys.stderr.isatty():
            said = second
            print(f"\rtick {tick}, {second} s, {recorder.size / 1e6:.1f} MB ", end="", file=sys.stderr)
    if said >= 0:
        print(file=sys.stderr)


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="tessera-record",
        description="Records what a client sees of the loaded world, tick by tick, to an MCAP file.",
        epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--connect", metavar="HOST:PORT", help="the coordinator (else $TESSERA_ADDRESS, or 127.0.0.1:7300)"
    )
    parser.add_argument("--output", metavar="FILE", required=True, help="a new file, NAME.mcap")
    parser.add_argument(
        "--every",
        metavar="N",
        type=int,
        default=1,
        help=f"record only ticks that are multiples of N, 1 to {EVERY_MAX} (default: 1)",
    )
    parser.add_argument(
        "--bodies", metavar="NAME", nargs="+", default=[], help="only these bodies, and contacts with them"
    )
    parser.add_argument(
        "--sector",
        metavar="I,J,K",
        type=_sector,
        help="draw relative to this sector's centre, as in --sector=-1,0,2^62 (default: the first body's)",
    )
    end = parser.add_mutually_exclusive_group()
    end.add_argument("--seconds", metavar="S", type=float, help="stop after this much simulated time")
    end.add_argument("--ticks", metavar="N", type=int, help="stop after this many ticks")
    options = parser.parse_args(arguments)
    for name in ("seconds", "ticks"):
        value = getattr(options, name)
        if value is not None and not 0 < value < math.inf:
            parser.error(f"--{name}: {value} is not above 0")
    return options


def _sector(text: str) -> Sector:
    """Three integers, also in the form 2^62."""
    i, j, k = (_integer(part) for part in text.split(","))
    return (i, j, k)


def _integer(text: str) -> int:
    sign = -1 if text.startswith("-") else 1
    base, _, exponent = text.removeprefix("-").partition("^")
    return int(sign * int(base) ** int(exponent or 1))


if __name__ == "__main__":
    sys.exit(main())
