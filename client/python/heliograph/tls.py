"""Encrypted connections: whom a client trusts, what it shows, and why a connection did not come about."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import pathlib
import re
import socket
import ssl
from typing import Any

import grpc

from .errors import HeliographError, Problem, Unavailable, invalid, invalid_all

#: A file's path.
File = str | os.PathLike[str]

_PATIENCE_S = 3.0  # for the connection that a diagnosis makes, and for each answer
# Systems keep the authorities that they trust in one of these files; Python does not know all of them.
_SYSTEM_ROOTS = ("/etc/ssl/certs/ca-certificates.crt", "/etc/pki/tls/certs/ca-bundle.crt", "/etc/ssl/cert.pem")
_ADDRESS = re.compile(r"(?:\[([^\[\]]+)\]|([^:\[\]/\s]+)):(\d{1,5})", re.ASCII)


@dataclasses.dataclass(frozen=True)
class Tls:
    """Files that were read and checked."""

    ca: str  # file of the authorities that the daemon's certificate may come from; empty: the system's
    certificate: str  # file of this client's certificate; empty: none
    key: str
    name: str  # that the daemon's certificate has; empty: the address's host
    roots: bytes | None = dataclasses.field(repr=False)
    chain: bytes | None = dataclasses.field(repr=False)
    secret: bytes | None = dataclasses.field(repr=False)

    def credentials(self) -> Any:
        return grpc.ssl_channel_credentials(self.roots, self.secret, self.chain)

    def options(self) -> list[tuple[str, Any]]:
        """Of gRPC's channel."""
        return [("grpc.ssl_target_name_override", self.name)] if self.name else []

    def context(self, problems: list[Problem] | None = None) -> ssl.SSLContext:
        """As gRPC has it, for Python's own TLS. What is wrong with the files goes into `problems`."""
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.set_alpn_protocols(["h2"])
        found = [] if problems is None else problems
        if self.roots is None:
            context.load_default_certs()
        else:
            try:
                context.load_verify_locations(cadata=self.roots.decode("ascii", "replace"))
            except (ssl.SSLError, ValueError):
                found.append(Problem("ca", self.ca or "the system's file", "a file of certificates in PEM form"))
        if self.certificate and self.key:
            try:
                context.load_cert_chain(self.certificate, self.key, password=_no_passphrase)
            except (ssl.SSLError, ValueError, OSError) as error:
                wanted = f"the key of {self.certificate}, both in PEM form ({_reason(error)})"
                found.append(Problem("key", self.key, wanted))
        return context


def _no_passphrase() -> str:
    raise ValueError("the key wants a passphrase")


def _reason(error: BaseException) -> str:
    return getattr(error, "reason", None) or str(error)


def read_tls(
    tls: bool | None = None,
    ca: File | None = None,
    certificate: File | None = None,
    key: File | None = None,
    tls_name: str | None = None,
) -> Tls | None:
    """What connect() was given; without it the variables HELIOGRAPH_TLS, HELIOGRAPH_TLS_CA,
    HELIOGRAPH_CLIENT_CERTIFICATE, HELIOGRAPH_CLIENT_KEY and HELIOGRAPH_TLS_NAME. None: no TLS. InvalidArgument names
    every problem."""
    if tls not in (None, True, False):
        raise invalid("tls", tls, "True, False, or None: as ca, certificate, key and the variables say")
    given = (ca, certificate, key, tls_name)
    if tls is False:
        if any(given):
            raise invalid("tls", False, "True or None beside ca, certificate, key and tls_name")
        return None
    variable = os.environ.get("HELIOGRAPH_TLS", "")
    if variable not in ("", "on", "off"):
        raise invalid("tls", f"by HELIOGRAPH_TLS: {variable}", "on, off")
    names = [
        os.fspath(value) if value is not None else os.environ.get(name, "")
        for value, name in (
            (ca, "HELIOGRAPH_TLS_CA"),
            (certificate, "HELIOGRAPH_CLIENT_CERTIFICATE"),
            (key, "HELIOGRAPH_CLIENT_KEY"),
        )
    ]
    name = os.environ.get("HELIOGRAPH_TLS_NAME", "") if tls_name is None else tls_name
    if tls is None and variable != "on" and not any(names) and not name:
        return None
    return _read_files(*names, name)


def _read_files(ca: str, certificate: str, key: str, name: str) -> Tls:
    problems: list[Problem] = []

    def read(field: str, file: str) -> bytes | None:
        if not file:
            return None
        try:
            return pathlib.Path(file).read_bytes()
        except OSError as error:
            problems.append(Problem(field, file, f"a file that can be read ({error.strerror})"))
            return None

    if bool(certificate) != bool(key):
        missing = "key" if certificate else "certificate"
        problems.append(Problem(missing, "none", "both certificate and key, or none of them"))
    roots = read("ca", ca) if ca else _system_roots()
    found = Tls(ca, certificate, key, name, roots, read("certificate", certificate), read("key", key))
    if not problems:
        found.context(problems)
    if problems:
        raise invalid_all(problems)
    return found


def _system_roots() -> bytes | None:
    """Wheels of grpcio trust the roots that they bring along, and not those of the system. None: they have to do."""
    if os.environ.get("GRPC_DEFAULT_SSL_ROOTS_FILE_PATH"):
        return None
    for file in (ssl.get_default_verify_paths().cafile, *_SYSTEM_ROOTS):
        if file:
            with contextlib.suppress(OSError):
                return pathlib.Path(file).read_bytes()
    return None


def explain(error: HeliographError, address: str, tls: Tls | None) -> HeliographError:
    """Of the first call to a daemon: with what TLS tells about it, where the daemon could not be reached."""
    if not isinstance(error, Unavailable):
        return error
    why = diagnose(address, tls)
    return Unavailable(f"no connection to the daemon at {address}: {why}", problems=()) if why else error


def diagnose(address: str, tls: Tls | None) -> str:
    """Why no connection came about, with what to give; empty: TLS does not explain it. Connects once more by itself,
    and takes a few seconds at most."""
    match = _ADDRESS.fullmatch(address)
    if not match:
        return ""
    host, port = match[1] or match[2], int(match[3])
    if tls is None:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.check_hostname = False
        context.verify_mode = ssl.CERT_NONE
    else:
        context = tls.context()
    name = tls.name if tls is not None and tls.name else host
    try:
        with socket.create_connection((host, port), _PATIENCE_S) as wire:
            return _shake_hands(context, wire, name, tls)
    except OSError:
        return ""


def _shake_hands(context: ssl.SSLContext, wire: socket.socket, name: str, tls: Tls | None) -> str:
    speaks = "it speaks TLS: connect with tls=True, and where its authority is not one of this machine's, with ca=FILE"
    try:
        line = context.wrap_socket(wire, server_hostname=name)
    except ssl.SSLCertVerificationError as error:
        return _of_certificate(error, tls)
    except ssl.SSLError as error:
        if tls is None:
            return speaks if "ALERT" in (error.reason or "") else ""
        if "ALERT" in (error.reason or ""):
            return _of_own_certificate(tls)
        return "it does not speak TLS: without it (no tls=, no ca=) all that travels can be read"
    except OSError:
        return ""
    if tls is None:
        line.close()
        return speaks
    # In TLS 1.3 a daemon that misses a certificate tells so after the handshake, or just hangs up.
    try:
        answer = line.recv(1)
    except ssl.SSLError:
        answer = b""
    except OSError:
        return ""
    finally:
        line.close()
    return "" if answer else _of_own_certificate(tls)


def _of_own_certificate(tls: Tls) -> str:
    if tls.certificate:
        return f"it does not accept the certificate in '{tls.certificate}'"
    return "it asks for a certificate of its callers, it seems: give one and its key (certificate=FILE, key=FILE)"


def _of_certificate(error: ssl.SSLCertVerificationError, tls: Tls | None) -> str:
    text = error.verify_message or str(error)
    # Numbers of OpenSSL (X509_V_ERR_...).
    if error.verify_code in (9, 10):
        return f"its certificate, or that of the authority, is not valid now ({text}): it needs a new one"
    if error.verify_code in (62, 64):
        return f"its certificate is for another name ({text}): give the name that it has (tls_name=)"
    if error.verify_code in (2, 7, 18, 19, 20, 21):
        whose = f"in '{tls.ca}'" if tls is not None and tls.ca else "that this machine trusts"
        return f"its certificate comes from no authority {whose} ({text}): give the file with the right one (ca=FILE)"
    return f"its certificate is not accepted: {text}"
