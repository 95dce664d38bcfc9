"""Folders with keys of a client, as `tessera keys create` makes them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import grpc

from tessera.errors import NotFound

DAEMON_NAME = "tessera-daemon"
"""In the certificates of all daemons of a cluster, whatever their hosts."""


@dataclass(frozen=True)
class Keys:
    """How a client shows who it is, and whom it accepts as a daemon; without an authority: no keys."""

    authority: bytes = b""
    certificate: bytes | None = None
    key: bytes | None = None
    token: str = ""

    @staticmethod
    def read(folder: str | os.PathLike[str]) -> Keys:
        """The keys in `folder`; none if it is empty. NotFound, naming the file, if one is missing."""
        if not os.fspath(folder):
            return Keys()
        path = Path(folder)
        if (path / "authority").is_dir():  # the outer folder
            path /= "admin"
        authority = _read(path / "authority.pem")
        has_certificate = (path / "key.pem").exists()
        # A token goes beside a certificate, too: it passes gateways, where certificates end.
        has_token = not has_certificate or (path / "token").exists()
        token = _read(path / "token").decode().strip() if has_token else ""
        if not has_certificate:
            return Keys(authority, token=token)
        return Keys(authority, _read(path / "certificate.pem"), _read(path / "key.pem"), token)

    def __bool__(self) -> bool:
        return bool(self.authority)

    def channel(self, address: str, options: Sequence[tuple[str, Any]]) -> grpc.Channel:
        """A channel to a daemon at host:port."""
        if not self:
            return grpc.insecure_channel(address, options)
        credentials = grpc.ssl_channel_credentials(self.authority, self.key, self.certificate)
        if self.token:
            credentials = grpc.composite_channel_credentials(
                credentials, grpc.access_token_call_credentials(self.token)
            )
        return grpc.secure_channel(address, credentials, [*options, ("grpc.ssl_target_name_override", DAEMON_NAME)])


def _read(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError as error:
        raise NotFound(f"{file} cannot be read ({error.strerror}): `tessera keys create` makes such folders") from None
