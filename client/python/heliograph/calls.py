"""Calls as values. An operation is a generator that yields calls, gets their answers and returns its result, so that
the same operation runs over blocking and over asynchronous gRPC."""

from __future__ import annotations

import dataclasses
from collections.abc import Generator, Iterable
from typing import Any, TypeVar

T = TypeVar("T")

#: Trailing metadata that names the fields which an older daemon ignored.
IGNORED_FIELDS = "heliograph-ignored-fields"


class Upload:
    """The messages of a client stream. What goes wrong while they are made is kept in `error`, for gRPC would swallow
    it."""

    def __init__(self, messages: Iterable[Any]) -> None:
        self._messages = messages
        self.error: BaseException | None = None

    def __iter__(self) -> Generator[Any, None, None]:
        try:
            yield from self._messages
        except GeneratorExit:
            raise
        except BaseException as error:
            self.error = error
            raise


@dataclasses.dataclass(frozen=True)
class Call:
    """One call with one answer.

    request: a message, or an Upload. quick: the daemon answers at once, so the client's timeout counts.
    """

    method: str
    request: Any
    quick: bool = True


Operation = Generator[Call, Any, T]
