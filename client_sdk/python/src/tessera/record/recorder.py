"""Records what a client sees of a cluster, tick by tick."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from importlib.metadata import version
from operator import attrgetter
from types import TracebackType
from typing import Any

import numpy as np
from google.protobuf import json_format

from tessera._proto import query_pb2, tessera_pb2, world_pb2
from tessera.any_client import CALL_TIMEOUT_S, AnyClient, Status
from tessera.errors import Cancelled, InvalidArgument, NotFound
from tessera.frame import BodyFrame, Ids, ProgramFrame, body_batch, body_frame
from tessera.position import Sector, SectorLike, sector_message, to_sector
from tessera.queries import programs
from tessera.record import topics
from tessera.record.mcap_writer import McapWriter
from tessera.record.scene import scene, transforms
from tessera.record.schema import definition_of
from tessera.record.sensors import NUMBERS_MAX, Drawing, draw, drawing_of, named
from tessera.references import BodyName
from tessera.results import FoundProgram

PROGRAMS_MAX = 100_000  # of the bodies that are asked for at once
EVERY_MAX = 1000  # ticks; contacts of the ticks in between are buffered at the servers


class Recorder:
    """A recording of the loaded world.

        with tessera.record.Recorder(client, "run.mcap") as recorder:
            client.step(120)
            recorder.run(ticks=120)

    It subscribes when it is constructed, and is complete from then on. Each tick has the states of bodies,
    their contacts, and what their programs measure. Each second of simulated time has the status of the cluster, and the static bodies if they
    have changed. The end of the `with` block completes the file; an interrupted file can be read up to its
    last second.
    """

    def __init__(
        self,
        client: AnyClient,
        path: str | os.PathLike[str],
        *,
        every: int = 1,
        bodies: Iterable[BodyName] = (),
        sector: SectorLike | None = None,
    ) -> None:
        """Records ticks that are multiples of `every`, at most 1000. Contacts that begin or end are recorded
        at each tick; continuing ones only if `every` is 1. With `bodies`, only these bodies and contacts with
        them are recorded. Drawings are relative to the centre of `sector`, by default that of the first body.

        FileExistsError, FailedPrecondition if no world is loaded, NotFound for a body that does not exist,
        InvalidArgument for `every`.
        """
        if not 1 <= every <= EVERY_MAX:
            raise InvalidArgument(f"every: {every} is not within 1 to {EVERY_MAX}")
        self._client = client
        self._every = every
        self._ids = [client.find(body).id if isinstance(body, str) else int(body) for body in bodies]
        with ExitStack() as ending:
            self._measured = ending.enter_context(client.watch_programs(ids=self._ids, every_ticks=every))
            self._contacts = ending.enter_context(client.watch_contacts(ids=self._ids, persisting=every == 1))
            self._bodies = ending.enter_context(
                client.watch_bodies(ids=self._ids, every_ticks=every, complete=True)
            )
            status = client.status()
            self.world: str = status.world
            self.time_step: float = status.settings.time_step
            self._sector_size: float = status.settings.sector_size
            self.sector = self._first_sector(status) if sector is None else to_sector(sector_message(sector))
            self._file = McapWriter(path, f"tessera {version('tessera')}")
            ending.callback(self._file.finish)
            self._begin(status)
            self._ending = ending.pop_all()
        self._programs: dict[tuple[int, int], FoundProgram] = {}  # by body and place
        self._program_tick: int | None = None  # the last that was read
        self._catalogue: dict[int, query_pb2.FoundBodies.Found] = {}
        self._names: dict[int, str] = {}
        self._shapes: dict[int, world_pb2.Shape] = {}
        self._present: Ids = np.empty(0, dtype=np.uint64)
        self._statics = tessera_pb2.BodyBatch()
        self._contact_tick: int | None = None  # the last that was read
        self._second = -1  # the last with a recorded status
        self.tick: int | None = None  # the last recorded one
        self.count = 0  # of recorded ticks

    @property
    def size(self) -> int:
        """Bytes of the file so far."""
        return self._file.size

    def run(self, ticks: int | None = None) -> None:
        """Records that many ticks from the current one on, or until `stop()`.

        Errors as `Stream.next()`: they end the recording, and the data so far is kept.
        """
        for _ in self.follow(ticks):
            pass

    def follow(self, ticks: int | None = None) -> Iterator[int]:
        """As `run()`, yielding each tick when it is recorded."""
        end: int | None = None
        while end is None or self._next_tick() <= end:
            try:
                frame = self._bodies.next()
            except Cancelled:
                return
            self._record(frame)
            if end is None and ticks is not None:
                end = frame.tick + ticks
            yield frame.tick

    def stop(self) -> None:
        """Ends `run()`. Safe to call from any thread."""
        self._bodies.cancel()

    def close(self) -> None:
        """Completes the file."""
        self._ending.close()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _begin(self, status: Status) -> None:
        self._file.add_metadata(
            topics.METADATA,
            {
                topics.WORLD: status.world,
                topics.SETTINGS: json_format.MessageToJson(
                    status.settings, preserving_proto_field_name=True, indent=0
                ),
                topics.ANCHOR: ",".join(map(str, to_sector(status.anchor))),
                topics.SECTOR: ",".join(map(str, self.sector)),
                topics.EVERY: str(self._every),
            },
        )
        self._channels = {
            topic: self._file.add_channel(topic, kind.DESCRIPTOR.full_name, definition_of(kind))
            for topic, kind in topics.MESSAGES.items()
        }

    def _next_tick(self) -> int:
        assert self.tick is not None
        return (self.tick // self._every + 1) * self._every

    def _first_sector(self, status: Status) -> Sector:
        """The sector of the first recorded body, or the anchor of a world without bodies."""
        first = self._ids[:1] or [body.id for body in self._client.find_bodies(limit=1)]
        for state in self._states_of(first).bodies:
            return to_sector(state.pose.position.sector)
        if self._ids:
            raise NotFound(f"bodies: none has the id {first[0]}")
        return to_sector(status.anchor)

    def _states_of(self, ids: list[int]) -> tessera_pb2.BodyBatch:
        """The current states of these bodies, static or not."""
        if not ids:
            return tessera_pb2.BodyBatch()
        with self._client.watch_bodies(ids=ids) as stream:
            return body_batch(stream.next(CALL_TIMEOUT_S))

    def _record(self, frame: BodyFrame) -> None:
        """Bodies have named fields in recordings, for tools that read them."""
        tick = frame.tick
        is_scene_old = False
        second = int(tick * self.time_step)
        if second > self._second:
            self._second = second
            is_scene_old = self._look(tick)
        if not np.array_equal(frame.ids, self._present):
            self._learn(tick, np.setdiff1d(frame.ids, self._present).tolist())
            self._present = frame.ids
            is_scene_old = True
        if is_scene_old:
            self._draw(tick)
        self._write(topics.BODIES, tick, body_batch(frame))
        self._write(topics.TF, tick, transforms(frame, self._names, self.sector, self._time_of(tick)))
        self._record_contacts(tick)
        self._record_programs(tick)
        self.tick = tick
        self.count += 1

    def _learn(self, tick: int, ids: list[int]) -> None:
        """Requests the names and shapes of new bodies."""
        new = [body for body in ids if body not in self._catalogue]
        if not new:
            return
        found = self._client.catalogue(new)
        self._catalogue.update((body.id, body) for body in found.bodies)
        self._names.update((body.id, body.name) for body in found.bodies)
        self._shapes.update(found.shapes)
        self._write(topics.CATALOGUE, tick, found)

    def _look(self, tick: int) -> bool:
        """Records the once-a-second topics. Returns whether static bodies have changed since last time."""
        self._file.end_chunk()
        status = self._client.status()
        self._write(topics.STATUS, status.tick, status)
        if self._ids:
            return False
        ids = [body.id for body in self._client.catalogue(only_static=True, with_shapes=False).bodies]
        before, self._statics = self._statics, self._states_of(ids)
        if before.bodies == self._statics.bodies:
            return False
        self._learn(tick, ids)
        self._statics.tick = tick
        frame = body_frame(tick, self._statics, self._sector_size)
        self._write(topics.STATIC_BODIES, tick, self._statics)
        self._write(topics.TF_STATIC, tick, transforms(frame, self._names, self.sector, self._time_of(tick)))
        return True

    def _draw(self, tick: int) -> None:
        """Records the shapes of all existing bodies."""
        ids = [state.id for state in self._statics.bodies] + self._present.tolist()
        bodies = [self._catalogue[body] for body in ids if body in self._catalogue]
        self._write(topics.SCENE, tick, scene(bodies, self._shapes, self._time_of(tick)))

    def _record_contacts(self, tick: int) -> None:
        """Records the contacts after the last recorded tick, up to `tick`."""
        while self._contact_tick is None or self._contact_tick < tick:
            is_first = self._contact_tick is None  # it may be incomplete
            self._contact_tick, parts = self._contacts.next_parts()
            if is_first or (self.tick is None and self._contact_tick < tick):
                continue
            contacts = _contacts_of(self._contact_tick, parts)
            if contacts.contacts or self._contact_tick % self._every == 0:
                self._write(topics.CONTACTS, self._contact_tick, contacts)

    def _record_programs(self, tick: int) -> None:
        """Records what programs have published after the last recorded tick, up to `tick`."""
        while self._program_tick is None or self._program_tick < tick:
            frame = self._measured.next()
            self._program_tick = frame.tick
            self._meet(frame)
            known = [(self._programs.get((sample.body, sample.program)), sample) for sample in frame.programs]
            told = [
                named(found, sample)
                for found, sample in known
                if found is not None and len(sample.values) <= NUMBERS_MAX
            ]
            if told:
                self._write(topics.PROGRAMS, frame.tick, query_pb2.FoundPrograms(programs=told))
            for found, sample in known:
                drawing = None if found is None else drawing_of(found)
                if found is not None and drawing is not None:
                    time = self._time_of(frame.tick)
                    self._write(self._topic_of(found, drawing), frame.tick, draw(drawing, found, sample, time))

    def _meet(self, frame: ProgramFrame) -> None:
        """Asks for the names and parameters of programs that are new."""
        new = {sample.body for sample in frame.programs if (sample.body, sample.program) not in self._programs}
        if new:
            for found in self._client.ask_one(programs(sorted(new), limit=PROGRAMS_MAX)):
                self._programs[found.body, found.program] = found

    def _topic_of(self, found: FoundProgram, drawing: Drawing) -> str:
        """Its topic, which may be new: "/robot/hull/scan"."""
        topic = f"/{found.body_name.replace('::', '/')}/{found.name or f'{drawing.topic}_{found.program}'}"
        if topic not in self._channels:
            kind = drawing.kind
            self._channels[topic] = self._file.add_channel(topic, kind.DESCRIPTOR.full_name, definition_of(kind))
        return topic

    def _time_of(self, tick: int) -> int:
        return topics.time_of(tick, self.time_step)

    def _write(self, topic: str, tick: int, message: Any) -> None:
        data = message.SerializeToString()
        self._file.write(self._channels[topic], self._time_of(tick), data, tick & 0xFFFFFFFF)


def _contacts_of(tick: int, parts: list[tessera_pb2.ContactBatch]) -> tessera_pb2.ContactBatch:
    """The parts of all servers for a tick, merged."""
    result = tessera_pb2.ContactBatch(tick=tick)
    for part in parts:
        result.contacts.extend(part.contacts)
    result.contacts.sort(key=attrgetter("trigger", "a", "b"))
    return result
