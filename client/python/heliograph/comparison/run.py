"""One call of compare(): its request, and what the stream of answers says. No input or output happens here: the
blocking client and heliograph.aio feed it."""

from __future__ import annotations

import contextlib
import pathlib
import time
import warnings
from collections.abc import Iterator, Sequence

from ..errors import (
    DeadlineExceeded,
    HeliographError,
    HeliographWarning,
    Internal,
    NotFound,
    Problem,
    invalid_all,
    with_fields_renamed,
)
from ..v1 import compare_pb2 as messages
from .folder import write_locked_folder
from .lock import locked
from .pictures import PictureFeed, PictureKey, Stored
from .record import (
    budgets_of,
    complete_reference,
    differences_of_shape,
    differences_of_values,
    extend,
    request_of,
    sort_units,
    view_count,
)
from .references import LoadedReference, ReferenceFile
from .request import Plan
from .result import Comparison
from .values import ComparisonProgress, make_progress

_TRIES = 3  # to load references that the daemon let go before it came to use them


class ComparisonRun:
    """Not thread safe."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._begun = time.monotonic()
        self._before = plan.resume.record if plan.resume is not None else messages.CompareRecord()
        if self._before.units:
            # Nothing of these could be put into one table, whatever mix= says.
            _refuse(differences_of_shape(self._before, plan.request), "the same")
        self._record = extend(self._before, plan.request, plan.scene_name, plan.scene_file)
        self._call = self._record.calls.add(begun=time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()))
        self._pictures: dict[PictureKey, Stored] = {}
        if plan.resume is not None and self._before.units:
            self._pictures.update(plan.resume.stored_pictures)
        self._feed: PictureFeed | None = None
        self._accepted = False
        self._tries = 0

    @property
    def output(self) -> pathlib.Path | None:
        """The folder that all of it is kept in."""
        return self._plan.output

    @property
    def files(self) -> tuple[ReferenceFile, ...]:
        """The references that must be loaded before the call is made."""
        return self._plan.files

    def request(self, loaded: Sequence[LoadedReference]) -> messages.CompareRequest:
        """What is asked. loaded: `files`, as the daemon has them now."""
        self._tries += 1
        asked = self._record.request
        self._record.ClearField("reference_files")
        if loaded:
            del asked.reference.loaded.reference_ids[:]
        for reference in loaded:
            asked.reference.loaded.reference_ids.append(reference.id)
            self._record.reference_files.add(path=reference.path, sha256=reference.sha256)
        request = request_of(self._record)
        if asked.send_pictures:
            names = ["", *(mode.name for mode in asked.modes)]
            wanted = [PictureKey(name, view) for view in range(view_count(asked)) for name in names]
            done = self._pictures_done()
            request.send_pictures = any(key not in done for key in wanted)
            for key in wanted if request.send_pictures else ():
                if key in done:
                    request.pictures_done.add(reference=not key.mode, mode=key.mode, view=key.view)
        return request

    def _pictures_done(self) -> set[PictureKey]:
        """Of a comparison that is resumed: those that it has, with the units that they are of."""
        last = len(budgets_of(self._record.request)) - 1
        units = {
            PictureKey(unit.mode, unit.view)
            for unit in self._record.units
            if unit.seed_number == 1 and unit.budget == last
        }
        done = set()
        for picture in self._record.pictures:
            key = PictureKey("" if picture.reference else picture.mode, picture.view)
            stored = self._pictures.get(key)
            if stored is None or (isinstance(stored, pathlib.Path) and not stored.exists()):
                continue
            if picture.reference:
                kept = not self._plan.mix  # which may name another reference
            else:
                kept = picture.budget == last and key in units
            if kept:
                done.add(key)
        return done

    def seconds_left(self) -> float | None:
        """Of the timeout; None: there is none. DeadlineExceeded: it has passed."""
        if self._plan.timeout is None:
            return None
        left = self._plan.timeout - (time.monotonic() - self._begun)
        if left <= 0:
            raise self._late()
        return left

    def _late(self) -> DeadlineExceeded:
        return DeadlineExceeded(f"the comparison was not done within {self._plan.timeout:g} s", problems=())

    def add(self, response: messages.CompareResponse) -> ComparisonProgress | None:
        """An answer; how far it is, where that is told. BrokenTile; InvalidArgument: units of `resume` that differ."""
        kind = response.WhichOneof("response")
        if kind == "accepted":
            self._accept(response.accepted)
        elif not self._accepted:
            raise Internal("an answer came before the comparison was accepted", problems=())
        elif kind == "progress":
            return make_progress(response.progress)
        elif kind == "reference":
            self._take_reference(response.reference)
        elif kind == "unit":
            self._record.units.add().CopyFrom(response.unit)
            self._call.units += 1
        elif kind == "picture":
            self._take_picture(response.picture)
        elif kind == "result":
            self._record.table.CopyFrom(response.result.table)
            self._call.rendering_seconds = response.result.rendering_seconds
            self._call.ended = True
        return None  # or something that a newer daemon says

    def _accept(self, accepted: messages.CompareResponse.Accepted) -> None:
        call, request = self._call, self._record.request
        call.version, call.build, call.isa, call.threads = (
            accepted.version,
            accepted.build,
            accepted.isa,
            accepted.threads,
        )
        del request.modes[:]
        request.modes.extend(accepted.modes)
        del request.views[:]
        request.views.extend(accepted.views)
        complete_reference(request)
        if self._before.units:
            differences = differences_of_values(self._before, self._record, call)
            if differences and not self._plan.mix:
                _refuse(differences, "the same, or mix=True")
            call.differences[:] = differences
        known = set(self._record.notices)
        self._record.notices.extend(notice for notice in accepted.notices if notice not in known)
        first = request.modes[0].settings
        self._feed = PictureFeed(first.width, first.height)
        self._accepted = True

    def _take_reference(self, reference: messages.CompareResponse.Reference) -> None:
        others = [known for known in self._record.references if known.view != reference.view]
        by_view = sorted([*others, reference], key=lambda known: int(known.view))
        copies = messages.CompareRecord(references=by_view).references
        self._record.ClearField("references")
        self._record.references.extend(copies)

    def _take_picture(self, message: messages.CompareResponse.Picture) -> None:
        assert self._feed is not None
        picture = self._feed.add(message)
        if picture is None:
            return
        key = PictureKey("" if message.reference else message.mode, message.view)
        self._pictures[key] = picture
        kept = [entry for entry in self._record.pictures if (entry.mode, entry.view) != (key.mode, key.view)]
        copies = messages.CompareRecord(pictures=kept).pictures
        entry = copies.add(reference=message.reference, view=message.view)
        if not message.reference:
            entry.mode, entry.seed_number, entry.budget = message.mode, message.seed_number, message.budget
        self._record.ClearField("pictures")
        self._record.pictures.extend(copies)

    def failed(self, error: HeliographError) -> HeliographError | None:
        """What the error of the call means to the caller; None: load the references again and repeat the call."""
        lost = isinstance(error, NotFound) and error.message.startswith("reference.loaded.")
        if lost and self.files and self._tries < _TRIES:
            return None
        if isinstance(error, DeadlineExceeded) and self._plan.timeout is not None:
            if time.monotonic() - self._begun >= self._plan.timeout:
                return self._late()
        return with_fields_renamed(error, self._plan.argument_of)

    def result(self) -> Comparison:
        """Once the call has ended well. Internal: without a table."""
        if not self._record.HasField("table"):
            raise Internal("the daemon ended the comparison without a result", problems=())
        comparison = self.comparison()
        assert comparison is not None
        return comparison

    def comparison(self) -> Comparison | None:
        """What there is so far; None: nothing. Before the daemon accepted the call it is what was to be resumed."""
        if not self._accepted:
            return self._plan.resume
        self._call.seconds = time.monotonic() - self._begun
        record = messages.CompareRecord()
        record.CopyFrom(self._record)
        sort_units(record)
        return Comparison(record, dict(self._pictures))

    def save(self, folder: pathlib.Path) -> None:
        """What there is so far, once the daemon accepted the call, into a folder that is locked. OSError."""
        comparison = self.comparison() if self._accepted else None
        if comparison is not None:
            write_locked_folder(folder, comparison.record, comparison.stored_pictures)


@contextlib.contextmanager
def keeping(run: ComparisonRun) -> Iterator[None]:
    """Gives any exception, KeyboardInterrupt included, an attribute `comparison` with what has come so far, and keeps
    that in the folder that was asked for."""
    with contextlib.ExitStack() as stack:
        if run.output is not None:
            stack.enter_context(locked(run.output))
        try:
            yield
        except BaseException as error:
            error.comparison = run.comparison()  # type: ignore[attr-defined]
            if run.output is not None:
                try:
                    run.save(run.output)
                except OSError as problem:
                    warnings.warn(f"the comparison could not be kept: {problem}", HeliographWarning, stacklevel=2)
            raise
        if run.output is not None:
            run.save(run.output)


def _refuse(differences: list[str], allowed: str) -> None:
    if differences:
        raise invalid_all([Problem("resume", difference, allowed) for difference in differences])
