"""Recordings of what a client saw, in MCAP files; `pip install tessera[record]`.

    import tessera.record

    with tessera.record.Recorder(client, "run.mcap") as recorder:
        client.step(120)
        recorder.run(ticks=120)

    with tessera.record.read("run.mcap") as recording:
        path = recording.trajectory("tower::box_10")

MCAP, since it is what the field's tools read (Foxglove, PlotJuggler, `mcap`), and since it has what a
recording of a cluster needs: many topics in one file, which carries the definitions of its messages and is
read without ours; an index by time; chunks, so that an interrupted recording loses its last second only.

States are in it losslessly, as the messages of the streams, and once more for tools that draw (see
`tessera.record.scene`). `tessera-record` records from the command line.
"""

from __future__ import annotations

import os

from tessera.record.recorder import Recorder
from tessera.record.recording import Recording

__all__ = ["Recorder", "Recording", "read"]


def read(path: str | os.PathLike[str]) -> Recording:
    """Opens a recording. OSError where that fails, InvalidArgument where the file is none."""
    return Recording(path)
