"""Queries: what clients ask about a world. Lists of them are answered at the end of one tick, in one call.

    ground = tessera.queries.rays(origins, (0, 0, -1))
    states = tessera.queries.body_states(ids)
    answers = client.ask([ground, states])
    print(answers.tick, answers[ground].distances, answers[states].local)

Units: m, kg, s, rad; vectors along the world's axes. Bodies are given by names or ids, also numpy's integers. `mask`
selects the collision categories that count, 0: all; `excepting` names bodies that rays pass through and that are not
found. A `ValueError` names an argument of another shape; bounds are checked by the cluster, which names the element of
the list and the field.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tessera._proto import query_pb2, tessera_pb2, world_pb2
from tessera.client_methods import asking
from tessera.columns import put_numbers
from tessera.errors import DataLoss
from tessera.frame import FoundContacts, to_found_contacts
from tessera.position import (
    IDENTITY,
    ORIGIN,
    Floats,
    PositionLike,
    VectorLike,
    position_message,
    to_position,
    to_quaternion,
    to_vector,
    vector_fields,
    world_pose_message,
)
from tessera.references import BodyName, IdsLike, JointName, id_list, name_list, reference, references
from tessera.results import (
    Applied,
    BodyDistance,
    BodyStates,
    Dynamics,
    FoundBody,
    FoundFrame,
    FoundJoint,
    FoundProgram,
    HashAt,
    JointStates,
    Neighbour,
    RayHit,
    RayHits,
    to_applied,
    to_body_states,
    to_distance,
    to_dynamics,
    to_found_programs,
    to_joint_states,
    to_ray_hits,
)

Catalogue: TypeAlias = query_pb2.FoundBodies
"""Bodies with their names and properties, and their shapes by the ids in the properties."""

T = TypeVar("T")

_ROW = {"origins": (3,), "directions": (3,), "sectors": (3,), "lengths": (), "excepting_by_ray": ()}
"""The shapes of what an array of rays has for each."""

Results: TypeAlias = Sequence[query_pb2.QueryResult]


@dataclass(frozen=True, eq=False)
class Query(Generic[T]):
    """A question, or many of one kind, and how their results are read. It may be asked again and again."""

    messages: Sequence[query_pb2.Query]
    read: Callable[[Results, int], T]  # of these messages, at that tick


class Answers:
    """What a request did and found.

    `answers[query]` has the result of a query; iterating gives those of all, in their order. `tick` is completed: of
    the results, or the last of the ticks. `applied` is what the commands did.
    """

    def __init__(self, reply: tessera_pb2.Reply, queries: Sequence[Query[Any]]) -> None:
        """DataLoss if the results are not those of the queries."""
        self.tick: int = reply.tick
        self.applied: Applied = to_applied(reply.applied)
        messages = [message for query in queries for message in query.messages]
        kinds = [message.WhichOneof("kind") for message in messages]
        if kinds != [result.WhichOneof("kind") for result in reply.results]:
            raise DataLoss("there are results of other queries: perhaps they were too large to be told again")
        self._results: list[Any] = []
        self._places: dict[Query[Any], int] = {}
        place = 0
        for query in queries:
            end = place + len(query.messages)
            self._places[query] = len(self._results)
            self._results.append(query.read(reply.results[place:end], reply.tick))
            place = end

    def __getitem__(self, query: Query[T]) -> T:
        result: T = self._results[self._places[query]]
        return result

    def __iter__(self) -> Iterator[Any]:
        return iter(self._results)

    def __len__(self) -> int:
        return len(self._results)


def ray(
    origin: PositionLike,
    direction: VectorLike,
    length: float = 100.0,
    *,
    mask: int = 0,
    excepting: Iterable[BodyName] = (),
) -> Query[RayHit | None]:
    """The nearest hit within `length` m, in any sectors on any servers; None if nothing is hit. `direction` may have
    any length but zero.
    """
    return _one(_first, ray=_ray(origin, direction, length, mask, excepting))


def ray_all(
    origin: PositionLike,
    direction: VectorLike,
    length: float = 100.0,
    *,
    mask: int = 0,
    excepting: Iterable[BodyName] = (),
) -> Query[list[RayHit]]:
    """The nearest hit of each body on a ray, ascending by distance and id."""
    fields = _ray(origin, direction, length, mask, excepting)
    return _one(_all, ray={**fields, "wanted": query_pb2.RayQuery.ALL})


def ray_any(
    origin: PositionLike,
    direction: VectorLike,
    length: float = 100.0,
    *,
    mask: int = 0,
    excepting: Iterable[BodyName] = (),
) -> Query[bool]:
    """Whether a ray hits anything: faster than the nearest."""
    fields = _ray(origin, direction, length, mask, excepting)
    return _one(lambda result, tick: result.ray.hit, ray={**fields, "wanted": query_pb2.RayQuery.ANY})


def rays(
    origins: ArrayLike,
    directions: ArrayLike,
    lengths: ArrayLike = 100.0,
    *,
    sectors: ArrayLike = ORIGIN,
    mask: int = 0,
    excepting: Iterable[BodyName] = (),
    excepting_by_ray: ArrayLike = 0,
) -> Query[RayHits]:
    """The nearest hits of n rays, as arrays, up to 100,000 in a request. `origins` [n, 3] or [3] in m from the centres
    of `sectors` [n, 3] or [3], 64-bit integers; `directions` [n, 3] or [3], of any length but zero; `lengths` [n] or
    one, in m. `excepting_by_ray` [n] or one: the id of a body that only this ray passes through; 0: none.
    """
    given = {
        "origins": np.asarray(origins, dtype=np.float64),
        "directions": np.asarray(directions, dtype=np.float64),
        "sectors": np.asarray(sectors, dtype=np.int64),
        "lengths": np.asarray(lengths, dtype=np.float64),
        "excepting_by_ray": np.asarray(excepting_by_ray, dtype=np.uint64),
    }
    counts = [len(array) for name, array in given.items() if array.ndim > len(_ROW[name])]
    count = counts[0] if counts else 1
    arrays = {name: _broadcast(array, (count, *_ROW[name]), name) for name, array in given.items()}
    message = query_pb2.Query(rays={"mask": mask, "except": references(excepting)})
    table = given["sectors"].reshape(-1, 3)
    if given["sectors"].ndim == 2:
        table, sector = np.unique(given["sectors"], axis=0, return_inverse=True)
        message.rays.sector.extend(sector.ravel().tolist())
    for row in table.tolist():
        message.rays.sectors.add(i=row[0], j=row[1], k=row[2])
    put_numbers(
        message.rays,
        origins=arrays["origins"],
        directions=arrays["directions"],
        lengths=arrays["lengths"],
        except_by_ray=arrays["excepting_by_ray"],
    )
    return Query([message], lambda results, tick: to_ray_hits(results[0].rays))


def sweep(
    probe: world_pb2.Shape,
    position: PositionLike,
    direction: VectorLike,
    length: float = 100.0,
    *,
    orientation: VectorLike = IDENTITY,
    mask: int = 0,
    excepting: Iterable[BodyName] = (),
) -> Query[RayHit | None]:
    """The first contact of a convex shape of one part that moves `length` m along `direction` without turning; None
    if it touches nothing.
    """
    fields = {
        "pose": world_pose_message(position, orientation),
        "probe": _geometry(probe),
        "direction": vector_fields(direction, "direction"),
        "length": float(length),
        "mask": mask,
        "except": references(excepting),
    }
    return _one(lambda result, tick: _nearest(result.sweep), sweep=fields)


def near(
    position: PositionLike,
    reach: float = 0.0,
    *,
    probe: world_pb2.Shape | None = None,
    orientation: VectorLike = IDENTITY,
    mask: int = 0,
    limit: int = 0,
    excepting: Iterable[BodyName] = (),
) -> Query[list[Neighbour]]:
    """The bodies within `reach` m of a convex probe of one part (not given: a point), by distance and id.

    With reach 0, the bodies that it overlaps. `reach` is at most 4 sectors; `limit` 0: 1000 bodies.
    """
    fields = {
        "pose": world_pose_message(position, orientation),
        "probe": None if probe is None else _geometry(probe),
        "reach": float(reach),
        "mask": mask,
        "limit": limit,
        "except": references(excepting),
    }
    return _one(
        lambda result, tick: [Neighbour(body.id, body.name, body.distance) for body in result.near.bodies],
        near=fields,
    )


def body_states(ids: IdsLike | None = None, prefix: str = "") -> Query[BodyStates]:
    """The states of bodies as arrays, ascending by id. Ids that no body has are skipped. With a `prefix`, also those
    whose names begin with it and that are not static; without both, all that are not static.
    """
    return _one(
        lambda result, tick: to_body_states(tick, result.states), states=_selection(ids, prefix)
    )


def joint_states(
    ids: IdsLike | None = None, prefix: str = "", *, efforts: bool = False, reactions: bool = False
) -> Query[JointStates]:
    """Likewise the positions and rates of joints; without `ids` and `prefix`, of all. With `efforts`, also what acts
    along their axes; with `reactions`, what they bear: see `JointStates`.
    """
    fields = _selection(ids, prefix) | {"efforts": efforts, "reactions": reactions}
    return _one(lambda result, tick: to_joint_states(tick, result.joint_states), joint_states=fields)


def contacts(
    bodies: BodyName | Iterable[BodyName] = (), prefix: str = "", *, limit: int = 0
) -> Query[FoundContacts]:
    """Where a body, or any of several, touches others; with a `prefix`, also bodies whose names begin with it. At most
    `limit` patches; 0: 1000.
    """
    fields = {"bodies": references(name_list(bodies)), "name_prefix": prefix, "limit": limit}
    return _one(lambda result, tick: to_found_contacts(tick, result.contacts), contacts=fields)


def programs(ids: IdsLike | None = None, prefix: str = "", *, limit: int = 0) -> Query[list[FoundProgram]]:
    """The programs of bodies with these ids, and of those whose names begin with `prefix`; without both, all. At most
    `limit`; 0: 1000.
    """
    fields = _selection(ids, prefix) | {"limit": limit}
    return _one(lambda result, tick: to_found_programs(result.programs), programs=fields)


def distance(a: BodyName, b: BodyName, reach: float) -> Query[BodyDistance | None]:
    """How near the surfaces of two bodies come to each other, in any sectors on any servers; None if they are farther
    apart than `reach` m, which is at most 4 sectors.
    """
    fields = {"a": reference(a), "b": reference(b), "reach": float(reach)}
    return _one(lambda result, tick: to_distance(result.distance), distance=fields)


def dynamics(
    body: BodyName | None = None,
    *,
    joint: JointName | None = None,
    accelerations: ArrayLike = (),
    points: Iterable[tuple[BodyName, VectorLike]] = (),
    mass_matrix: bool = False,
) -> Query[Dynamics]:
    """The dynamics of the assembly of a dynamic body, or of a joint: all bodies that joints connect with it, which must
    form a tree. `accelerations` [d], for which efforts are found; `points` of its bodies, in their body frames, of
    which Jacobians are.
    """
    fields = {
        "body": None if body is None else reference(body),
        "joint": None if joint is None else reference(joint),
        "accelerations": np.asarray(accelerations, dtype=np.float64).ravel().tolist(),
        "points": [{"body": reference(of), "local": vector_fields(local, "point")} for of, local in points],
        "mass_matrix": mass_matrix,
    }
    return _one(lambda result, tick: to_dynamics(tick, result.dynamics), dynamics=fields)


def mass_matrix(body: BodyName) -> Query[Floats]:
    """The mass matrix [d, d] of the assembly of a dynamic body; see `Dynamics` for its degrees of freedom."""
    return _part(dynamics(body, mass_matrix=True), lambda found: found.mass_matrix)


def jacobian(body: BodyName, point: VectorLike = (0.0, 0.0, 0.0)) -> Query[Floats]:
    """How a point of a dynamic body, in its body frame, moves with the degrees of freedom of its assembly [6, d]: its
    velocity, then the angular velocity of the body, along the world's axes.
    """
    return _part(dynamics(body, points=[(body, point)]), _only_jacobian)


def inverse_dynamics(body: BodyName, accelerations: ArrayLike) -> Query[Floats]:
    """The efforts [d] that give the assembly of a dynamic body these accelerations [d]."""
    return _part(dynamics(body, accelerations=accelerations), lambda found: found.efforts)


def hash() -> Query[HashAt]:
    """The hash of the world's state."""
    return _one(lambda result, tick: HashAt(tick, result.hash.hash, result.hash.programs), hash={})


def catalogue(
    ids: IdsLike | None = None,
    *,
    prefix: str = "",
    only_static: bool = False,
    with_shapes: bool = True,
    limit: int = 0,
) -> Query[Catalogue]:
    """Bodies, ascending by id, that meet all conditions that are set, at most `limit`; 0: 1000."""
    fields = _selection(ids, prefix) | {"limit": limit, "only_static": only_static, "with_shapes": with_shapes}
    return _one(lambda result, tick: result.find_bodies, find_bodies=fields)


def find_bodies(prefix: str = "", limit: int = 0) -> Query[list[FoundBody]]:
    """Bodies whose names begin with `prefix`, ascending by id, at most `limit`; 0: 1000."""
    return _one(
        lambda result, tick: [
            FoundBody(body.id, body.name, body.properties, body.user_data, body.owner)
            for body in result.find_bodies.bodies
        ],
        find_bodies={"name_prefix": prefix, "limit": limit},
    )


def find_joints(prefix: str = "", limit: int = 0) -> Query[list[FoundJoint]]:
    """Joints whose names begin with `prefix`, ascending by id, at most `limit`; 0: 1000."""
    return _one(
        lambda result, tick: [
            FoundJoint(
                found.id,
                found.joint.name,
                found.parent,
                found.child,
                found.joint,
                to_vector(found.parent_centre),
                to_vector(found.child_centre),
            )
            for found in result.find_joints.joints
        ],
        find_joints={"name_prefix": prefix, "limit": limit},
    )


def find_frames(prefix: str = "", limit: int = 0) -> Query[list[FoundFrame]]:
    """Frames whose names begin with `prefix`, ascending by name, at most `limit`; 0: 1000."""
    return _one(
        lambda result, tick: [_frame(found) for found in result.find_frames.frames],
        find_frames={"name_prefix": prefix, "limit": limit},
    )


class QueryMethods:
    """Methods of a client that are one query. Each returns its result."""

    hash = asking(hash)
    near = asking(near)
    sweep = asking(sweep)
    body_states = asking(body_states)
    joint_states = asking(joint_states)
    contacts = asking(contacts)
    programs = asking(programs)
    distance = asking(distance)
    dynamics = asking(dynamics)
    mass_matrix = asking(mass_matrix)
    jacobian = asking(jacobian)
    inverse_dynamics = asking(inverse_dynamics)
    find_bodies = asking(find_bodies)
    find_joints = asking(find_joints)
    find_frames = asking(find_frames)


def _only_jacobian(found: Dynamics) -> Floats:
    jacobian: Floats = found.jacobians[0]
    return jacobian


def _part(whole: Query[Dynamics], read: Callable[[Dynamics], T]) -> Query[T]:
    return Query(whole.messages, lambda results, tick: read(whole.read(results, tick)))


def _one(read: Callable[[query_pb2.QueryResult, int], T], **fields: Any) -> Query[T]:
    return Query([query_pb2.Query(**fields)], lambda results, tick: read(results[0], tick))


def _ray(
    origin: PositionLike, direction: VectorLike, length: float, mask: int, excepting: Iterable[BodyName]
) -> dict[str, Any]:
    return {
        "origin": position_message(origin),
        "direction": vector_fields(direction, "direction"),
        "length": float(length),
        "mask": mask,
        "except": references(excepting),
    }


def _selection(ids: IdsLike | None, prefix: str) -> dict[str, Any]:
    if ids is None:
        return {"name_prefix": prefix}
    return {"ids": id_list(ids) or [0], "name_prefix": prefix}  # no body: without ids, all would be meant


def _geometry(probe: world_pb2.Shape) -> world_pb2.Geometry:
    (part,) = probe.parts
    geometry: world_pb2.Geometry = part.geometry
    return geometry


def _broadcast(array: NDArray[Any], shape: tuple[int, ...], name: str) -> NDArray[Any]:
    try:
        return np.broadcast_to(array, shape)
    except ValueError:
        wanted = f"{list(shape)} or {list(shape[1:])}"
        raise ValueError(f"{name}: an array {wanted} is expected, not one of shape {array.shape}") from None


def _hit(hit: query_pb2.RayHits.Hit) -> RayHit:
    return RayHit(hit.body, hit.name, hit.distance, to_position(hit.position), to_vector(hit.normal))


def _nearest(hits: query_pb2.RayHits) -> RayHit | None:
    return _hit(hits.hits[0]) if hits.hits else None


def _first(result: query_pb2.QueryResult, tick: int) -> RayHit | None:
    return _nearest(result.ray)


def _all(result: query_pb2.QueryResult, tick: int) -> list[RayHit]:
    return [_hit(hit) for hit in result.ray.hits]


def _frame(found: query_pb2.FoundFrames.Found) -> FoundFrame:
    frame = found.frame
    return FoundFrame(
        frame.name,
        frame.body,
        found.body,
        to_vector(frame.pose.position),
        to_quaternion(frame.pose.orientation),
    )
