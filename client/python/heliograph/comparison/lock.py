"""The lock of a comparison's folder, which the command `heliograph compare` takes as well: the file comparison.lock."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import pathlib
import re
import socket
import warnings
from collections.abc import Iterator

from ..errors import FailedPrecondition, HeliographWarning

_TRIES = 100  # others may remove their file between our steps


@contextlib.contextmanager
def locked(folder: pathlib.Path) -> Iterator[None]:
    """Keeps other processes, and other threads of this one, from writing to the folder; makes it where it does not
    exist, and removes it afterwards where nothing was written.

    FailedPrecondition: another one holds the lock. OSError: folder or file cannot be made.
    """
    file, made = _take(folder)
    try:
        yield
    finally:
        (folder / "comparison.lock").unlink(missing_ok=True)  # while it is held: _take() of others notices
        os.close(file)
        if made:
            with contextlib.suppress(OSError):
                folder.rmdir()


def _take(folder: pathlib.Path) -> tuple[int, bool]:
    """The file, locked and with the name of this process in it, and whether the folder was made."""
    path = folder / "comparison.lock"
    for _ in range(_TRIES):
        made = not folder.exists()
        folder.mkdir(parents=True, exist_ok=True)
        try:
            file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o666)
        except FileNotFoundError:
            continue
        try:
            if not _lock(file, folder):
                warnings.warn(
                    f"the file system of '{folder}' knows no locks: another comparison in this folder at the same "
                    "time would lose pictures",
                    HeliographWarning,
                    stacklevel=6,
                )
            elif not _is_there(file, path):
                os.close(file)
                continue
            os.ftruncate(file, 0)
            os.pwrite(file, f"process {os.getpid()} on {socket.gethostname()}".encode(), 0)
        except BaseException:
            os.close(file)
            raise
        return file, made
    raise OSError(errno.ENOENT, os.strerror(errno.ENOENT), os.fspath(path))


def _lock(file: int, folder: pathlib.Path) -> bool:
    """False: the file system knows no locks."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise FailedPrecondition(
            f"the folder '{folder}' is in use: {_holder(file)} is writing a comparison into it; allowed: another "
            "folder, or this one once that has ended",
            problems=(),
        ) from None
    except OSError:
        return False
    return True


def _holder(file: int) -> str:
    """Of the lock, as it wrote into its file."""
    text = os.pread(file, 300, 0).decode("latin-1")
    return text if re.fullmatch("process [ -~]*", text) else "another process"


def _is_there(file: int, path: pathlib.Path) -> bool:
    """The path still names the file: its holder has not removed it since it was opened."""
    try:
        return os.path.samestat(os.fstat(file), os.stat(path))
    except FileNotFoundError:
        return False
