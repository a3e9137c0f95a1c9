"""Addresses of daemons, and tokens."""

from __future__ import annotations

import ipaddress
import os
import pathlib
import re

from .errors import InvalidArgument, NotFound, invalid

_HOST_PORT = re.compile(r"(?:\[([^\[\]]+)\]|([^:\[\]/\s]+)):(\d{1,5})", re.ASCII)
_ALLOWED = "HOST:PORT with a port in [1, 65535], such as 127.0.0.1:50051, or unix:PATH"


def check_address(address: str) -> str:
    """The address; InvalidArgument where it is neither HOST:PORT nor unix:PATH."""
    if isinstance(address, str):
        if address.startswith("unix:") and len(address) > 5:
            return address
        match = _HOST_PORT.fullmatch(address)
        if match and 1 <= int(match[3]) <= 65535:
            return address
    raise invalid("address", address, _ALLOWED)


def is_near(address: str) -> bool:
    """Whether the daemon is on this machine: bytes are cheap then."""
    if address.startswith("unix:"):
        return True
    match = _HOST_PORT.fullmatch(address)
    host = (match[1] or match[2]) if match else ""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def read_token(token: str | None, token_file: str | os.PathLike[str] | None) -> str:
    """The token; without one the first line of token_file, or of the file that HELIOGRAPH_TOKEN_FILE names, that is
    neither empty nor begins with "#"; empty: none. NotFound: the file cannot be read. InvalidArgument: it holds no
    token, both are given, or the token has characters that no header carries.
    """
    if token is not None and token_file is not None:
        raise invalid("token_file", os.fspath(token_file), "either token or token_file")
    if token is None:
        file = token_file if token_file is not None else os.environ.get("HELIOGRAPH_TOKEN_FILE", "")
        if not os.fspath(file):
            return ""
        try:
            lines = pathlib.Path(file).read_text("utf-8", "replace").splitlines()
        except OSError as error:
            raise NotFound(f"token file {os.fspath(file)}: {error.strerror}", problems=()) from None
        token = next((line.rstrip() for line in lines if line.strip() and not line.startswith("#")), "")
        if not token:
            raise InvalidArgument(f"token file {os.fspath(file)} holds no token", problems=())
        if " " in token or "\t" in token:
            raise InvalidArgument(
                f"token file {os.fspath(file)} holds no token but what a daemon knows of one", problems=()
            )
    if not isinstance(token, str) or not token.isascii() or not token.isprintable() or " " in token:
        raise invalid("token", "(not shown)", "printable ASCII characters without spaces")
    return token
