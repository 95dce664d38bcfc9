"""Methods of a client that are one command or one query, from the functions that make these."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar

if TYPE_CHECKING:
    from tessera._proto.command_pb2 import Command
    from tessera.any_client import AnyClient
    from tessera.queries import Query
    from tessera.results import Added

P = ParamSpec("P")
T = TypeVar("T")
M = TypeVar("M", bound=Callable[..., Any])


def doing(make: Callable[P, Command | list[Command]]) -> Callable[Concatenate[AnyClient, P], int]:
    """Applies the command, and returns the tick at which it takes effect."""

    def method(self: AnyClient, /, *args: P.args, **kwargs: P.kwargs) -> int:
        made = make(*args, **kwargs)
        return self.apply(made if isinstance(made, list) else [made]).tick

    return _as(make, method)


def adding(make: Callable[P, Command]) -> Callable[Concatenate[AnyClient, P], Added]:
    """Applies the command, and returns what it makes."""

    def method(self: AnyClient, /, *args: P.args, **kwargs: P.kwargs) -> Added:
        (added,) = self.apply([make(*args, **kwargs)]).created
        return added

    return _as(make, method)


def asking(make: Callable[P, Query[T]]) -> Callable[Concatenate[AnyClient, P], T]:
    """Asks the query, and returns its result."""

    def method(self: AnyClient, /, *args: P.args, **kwargs: P.kwargs) -> T:
        return self.ask_one(make(*args, **kwargs))

    return _as(make, method)


def _as(make: Callable[..., Any], method: M) -> M:
    """With the name, the arguments and the description of `make`, for help()."""
    signature = inspect.signature(make)
    own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    returned = inspect.signature(method).return_annotation
    vars(method)["__signature__"] = signature.replace(
        parameters=[own, *signature.parameters.values()], return_annotation=returned
    )
    method.__name__ = make.__name__
    method.__qualname__ = f"AnyClient.{make.__name__}"
    method.__doc__ = make.__doc__
    return method
