"""The contents of a recording: its topics, their messages, and the times of ticks."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tessera._proto import query_pb2, tessera_pb2
from tessera.record.schema import FrameTransforms, SceneUpdate

BODIES = "/tessera/bodies"  # states at every recorded tick, ascending by id
STATIC_BODIES = "/tessera/static_bodies"  # likewise, after changes
CONTACTS = "/tessera/contacts"  # ascending by (a, b)
PROGRAMS = "/tessera/programs"  # values that have changed, by their names
STATUS = "/tessera/status"  # once a second
CATALOGUE = "/tessera/catalogue"  # new bodies: names, properties, shapes
TF = "/tf"  # for drawing, see tessera.record.scene: frames of bodies
TF_STATIC = "/tf_static"
SCENE = "/scene"

MESSAGES: dict[str, Any] = {
    BODIES: tessera_pb2.BodyBatch,
    STATIC_BODIES: tessera_pb2.BodyBatch,
    CONTACTS: tessera_pb2.ContactBatch,
    PROGRAMS: query_pb2.FoundPrograms,
    STATUS: tessera_pb2.StatusReply,
    CATALOGUE: query_pb2.FoundBodies,
    TF: FrameTransforms,
    TF_STATIC: FrameTransforms,
    SCENE: SceneUpdate,
}

METADATA = "tessera"  # the name of the record with:
WORLD, SETTINGS, ANCHOR, SECTOR, EVERY = "world", "settings", "anchor", "sector", "every_ticks"

NANOSECONDS = 1_000_000_000  # in a second


def time_of(tick: int, time_step: float) -> int:
    """The simulated time of a tick in ns; `time_step` in s."""
    return round(tick * time_step * NANOSECONDS)


def ticks_of(times: NDArray[np.uint64], time_step: float) -> NDArray[np.uint64]:
    """The ticks at these times."""
    ticks: NDArray[np.uint64] = np.rint(times / (time_step * NANOSECONDS)).astype(np.uint64)
    return ticks
