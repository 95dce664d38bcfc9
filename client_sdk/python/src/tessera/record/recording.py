"""Reads recordings, with the same data types as the client of a running cluster."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from types import TracebackType

import numpy as np
from google.protobuf import json_format
from numpy.typing import NDArray

from tessera._proto import query_pb2, tessera_pb2, world_pb2
from tessera.any_client import Status
from tessera.errors import InvalidArgument, NotFound
from tessera.frame import BodyFrame, ContactFrame, Trajectory, body_frame, contact_frame, trajectory
from tessera.position import Sector
from tessera.record import topics
from tessera.record.mcap_reader import McapReader
from tessera.references import BodyName, name_list
from tessera.results import FoundBody, FoundProgram, to_found_programs


class Recording:
    """A file of `tessera-record`, or of a `Recorder`.

        with tessera.record.read("run.mcap") as recording:
            path = recording.trajectory("tower::box_10")
            plt.plot(path.time, path.relative_to()[:, 0, 2])

    Reads only the requested data. For one thread at a time.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """OSError if the file cannot be opened, InvalidArgument if it is not a recording."""
        self._reader = McapReader(path)
        said = self._reader.metadata.get(topics.METADATA)
        if said is None:
            self._reader.close()
            raise InvalidArgument(f"{os.fspath(path)} is not a recording of a world")
        self.world = said[topics.WORLD]
        self.settings = json_format.Parse(said[topics.SETTINGS], world_pb2.WorldSettings())
        self.anchor = _sector(said[topics.ANCHOR])
        self.sector = _sector(said[topics.SECTOR])  # which drawings are relative to
        self.every_ticks = int(said[topics.EVERY])
        self.time_step: float = self.settings.time_step  # s
        self.is_whole = self._reader.is_whole  # false if the recorder was interrupted
        self.ticks = self._ticks_of(topics.BODIES)  # ascending
        self.bodies: dict[int, FoundBody] = {}  # all that were seen, by id
        self.shapes: dict[int, world_pb2.Shape] = {}  # by `properties.shape` of bodies
        for message in self._reader.messages(topics.CATALOGUE):
            catalogue = query_pb2.FoundBodies.FromString(message.data)
            self.shapes.update(catalogue.shapes)
            for body in catalogue.bodies:
                self.bodies[body.id] = FoundBody(body.id, body.name, body.properties)

    def close(self) -> None:
        self._reader.close()

    def __enter__(self) -> Recording:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __len__(self) -> int:
        """The number of recorded ticks."""
        return len(self.ticks)

    def find(self, name: str) -> FoundBody:
        """The body of that name. NotFound if none was recorded."""
        for body in self.bodies.values():
            if body.name == name:
                return body
        raise NotFound(f'no body was called "{name}"')

    def frame(self, tick: int) -> BodyFrame:
        """The bodies at a recorded tick: all that are not static, or those selected for the recording.
        KeyError for any other tick.
        """
        place = _place(self.ticks, tick)
        return next(self._frames(topics.BODIES, place, place + 1))

    def frames(self, start: int = 0, stop: int | None = None) -> Iterator[BodyFrame]:
        """The frames of ticks from `start` on, before `stop`."""
        first, last = np.searchsorted(self.ticks, (start, np.iinfo(np.int64).max if stop is None else stop))
        return self._frames(topics.BODIES, int(first), int(last))

    def contacts(self, tick: int) -> ContactFrame:
        """The contacts of a tick: all if `every_ticks` is 1, otherwise those that begin or end. KeyError if
        none were recorded, as for the first tick of a paused world: contacts belong to completed ticks.
        """
        place = _place(self._ticks_of(topics.CONTACTS), tick)
        (message,) = self._reader.messages(topics.CONTACTS, place, place + 1)
        return contact_frame(tick, [tessera_pb2.ContactBatch.FromString(message.data)])

    def programs(self, tick: int) -> list[FoundProgram]:
        """The programs whose values have changed at a tick, with these values; rangers of many rays are drawn
        alone. KeyError if there are none.
        """
        place = _place(self._ticks_of(topics.PROGRAMS), tick)
        (message,) = self._reader.messages(topics.PROGRAMS, place, place + 1)
        return to_found_programs(query_pb2.FoundPrograms.FromString(message.data))

    def static_bodies(self, tick: int) -> BodyFrame:
        """The latest recorded static bodies at this tick. KeyError before the first."""
        seen = self._ticks_of(topics.STATIC_BODIES)
        place = int(np.searchsorted(seen, tick, side="right"))
        if place == 0:
            raise KeyError(tick)
        return next(self._frames(topics.STATIC_BODIES, place - 1, place))

    def statuses(self) -> Iterator[Status]:
        """The status of the cluster, once a second of simulated time."""
        for message in self._reader.messages(topics.STATUS):
            yield tessera_pb2.StatusReply.FromString(message.data)

    def trajectory(
        self, bodies: BodyName | Sequence[BodyName], start: int = 0, stop: int | None = None
    ) -> Trajectory:
        """The states of bodies over the recorded ticks from `start` on, before `stop`. NotFound for a body
        that is missing in any of them; InvalidArgument if there are none.
        """
        names = name_list(bodies)
        ids = sorted({self.find(name).id if isinstance(name, str) else int(name) for name in names})
        try:
            frames = [frame.of(ids) for frame in self.frames(start, stop)]
        except KeyError as missing:
            raise NotFound(f"bodies: {missing} is missing in some of the ticks") from None
        if not frames:
            raise InvalidArgument(f"start, stop: no tick from {start} to {stop} was recorded")
        return trajectory(frames, self.time_step)

    def _ticks_of(self, topic: str) -> NDArray[np.uint64]:
        return topics.ticks_of(self._reader.times(topic), self.time_step)

    def _frames(self, topic: str, first: int, last: int) -> Iterator[BodyFrame]:
        for message in self._reader.messages(topic, first, last):
            batch = tessera_pb2.BodyBatch.FromString(message.data)
            yield body_frame(batch.tick, batch, self.settings.sector_size)


def _place(ticks: NDArray[np.uint64], tick: int) -> int:
    place = int(np.searchsorted(ticks, np.uint64(tick)))
    if place == len(ticks) or ticks[place] != tick:
        raise KeyError(tick)
    return place


def _sector(text: str) -> Sector:
    i, j, k = map(int, text.split(","))
    return (i, j, k)
