"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import pathlib
import secrets
from collections.abc import Iterator

from .errors import invalid


class AtomicFile:
    """A temporary file beside `path`, which commit() flushes to the disk and renames. A context manager: without
    commit() `path` is as it was and no temporary file is left. OSError names `path`.

    ending: that the name must have, empty: any; InvalidArgument.
    """

    def __init__(self, path: str | os.PathLike[str], ending: str = "") -> None:
        self.path = pathlib.Path(path)
        if ending and self.path.suffix.lower() != ending:
            raise invalid("path", str(self.path), f"a name that ends in {ending}")
        self._temporary = self.path.with_name(f".{self.path.name[:200]}.{secrets.token_hex(6)}.tmp")
        with self._naming_path():
            self._file = open(self._temporary, "xb")

    def write(self, data: bytes) -> None:
        with self._naming_path():
            self._file.write(data)

    def commit(self) -> pathlib.Path:
        with self._naming_path():
            self._file.flush()
            os.fsync(self._file.fileno())
            self._file.close()
            os.replace(self._temporary, self.path)
        return self.path

    @contextlib.contextmanager
    def _naming_path(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            if error.errno is None:
                raise
            raise OSError(error.errno, error.strerror, str(self.path)) from None

    def __enter__(self) -> AtomicFile:
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError):
            self._file.close()
        with contextlib.suppress(OSError):
            self._temporary.unlink()


def write_atomically(path: str | os.PathLike[str], data: bytes) -> None:
    """The file whole, as of AtomicFile."""
    with AtomicFile(path) as file:
        file.write(data)
        file.commit()
