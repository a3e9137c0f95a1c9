"""The folder in which a comparison is kept, which the command `heliograph compare` reads and writes as well:

comparison.json                      the record (CompareRecord)
pictures/reference.view0.exr         the reference of a view: R, G, B, float
pictures/MODE.view0.exr              of the mode, the first seed and the last budget
units.csv, points.csv, ratios.csv    once the table is there
comparison.lock                      while somebody writes to it
"""

from __future__ import annotations

import os
import pathlib
from collections.abc import Mapping

from ..errors import InvalidArgument, NotFound
from ..files import write_atomically
from ..v1 import compare_pb2 as messages
from .lock import locked
from .pictures import PictureKey, Stored, encode_picture
from .record import parse_record, record_json
from .tables import points_table, ratios_table, to_csv, units_table

_RECORD = "comparison.json"


def picture_file(key: PictureKey) -> str:
    """ "pictures/bdpt.view3.exr", relative to the folder."""
    # No mode's name begins with '+'.
    what = {"": "reference", "reference": "+reference"}.get(key.mode, key.mode)
    return f"pictures/{what}.view{key.view}.exr"


def write_folder(folder: pathlib.Path, record: messages.CompareRecord, pictures: Mapping[PictureKey, Stored]) -> None:
    """FailedPrecondition: somebody else is writing to the folder. OSError: something cannot be written."""
    with locked(folder):
        write_locked_folder(folder, record, pictures)


def write_locked_folder(
    folder: pathlib.Path, record: messages.CompareRecord, pictures: Mapping[PictureKey, Stored]
) -> None:
    """Pictures first, so that a record names none that is not there."""
    (folder / "pictures").mkdir(exist_ok=True)
    written = messages.CompareRecord()
    written.CopyFrom(record)
    written.ClearField("pictures")
    for entry in record.pictures:
        key = PictureKey("" if entry.reference else entry.mode, entry.view)
        stored = pictures.get(key)
        if stored is None:
            continue
        copy = written.pictures.add()
        copy.CopyFrom(entry)
        copy.file = picture_file(key)
        target = folder / copy.file
        if isinstance(stored, pathlib.Path):
            if not target.exists() or not target.samefile(stored):
                write_atomically(target, stored.read_bytes())
        else:
            write_atomically(target, encode_picture(stored))
    write_atomically(folder / _RECORD, record_json(written).encode())
    if record.HasField("table"):
        for name, table in (("units", units_table), ("points", points_table), ("ratios", ratios_table)):
            write_atomically(folder / f"{name}.csv", to_csv(table(record)).encode())


def read_folder(path: pathlib.Path) -> tuple[messages.CompareRecord, dict[PictureKey, Stored]]:
    """Of a folder, or of the comparison.json in it. NotFound, InvalidArgument: the file."""
    file = path / _RECORD if path.is_dir() else path
    try:
        text = file.read_bytes().decode()
    except UnicodeDecodeError as error:
        raise InvalidArgument(f"{file}: is no record of a comparison: {error}", problems=()) from None
    except OSError as error:
        raise NotFound(f"{file}: {error.strerror or 'cannot be read'}", problems=()) from None
    record = parse_record(text, os.fspath(file))
    pictures: dict[PictureKey, Stored] = {}
    for number, entry in enumerate(record.pictures):
        name = pathlib.PurePosixPath(entry.file)
        if name.is_absolute() or ".." in name.parts or not name.parts:
            raise InvalidArgument(
                f"{file}: pictures/{number}/file: '{entry.file}'; allowed: a path within the folder", problems=()
            )
        pictures[PictureKey("" if entry.reference else entry.mode, entry.view)] = file.parent / name
    return record, pictures
