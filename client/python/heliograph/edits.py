"""Edits of a loaded scene, from dictionaries to the protocol's messages."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from .camera import read_vector
from .errors import HeliographError, Problem, invalid, invalid_all
from .v1 import scene_edit_pb2 as edits

#: Name or number of a material, light or object, to what changes of it.
Changes = Mapping[str | int, Mapping[str, Any]]


def make_edits(
    materials: Changes | None, lights: Changes | None, objects: Changes | None, environment: Mapping[str, Any] | None
) -> list[edits.SceneEdit]:
    """InvalidArgument names every key and value that is wrong; the daemon checks names and ranges."""
    made: list[edits.SceneEdit] = []
    problems: list[Problem] = []
    for kind, changes in (("material", materials), ("light", lights), ("object", objects)):
        for target, values in (changes or {}).items():
            edit = edits.SceneEdit()
            message = getattr(edit, kind)
            place = f"{kind}s[{target!r}]"
            if isinstance(target, str):
                message.name = target
            elif isinstance(target, int) and not isinstance(target, bool) and 0 <= target < 2**32:
                message.index = target
            else:
                problems.append(Problem(place, repr(target), "a name, or a number from 0"))
                continue
            _fill(message, values, place, problems)
            made.append(edit)
    if environment:
        edit = edits.SceneEdit()
        edit.environment.SetInParent()
        _fill(edit.environment, environment, "environment", problems)
        made.append(edit)
    if problems:
        raise invalid_all(problems)
    if not made:
        raise invalid("edit", "nothing", "any of materials, lights, objects, environment")
    return made


def argument_of(made: list[edits.SceneEdit], field: str) -> str:
    """Of edits[0].material.base_color "materials['red'].base_color": what the caller wrote."""
    match = re.fullmatch(r"edits\[(\d+)\]\.(material|light|object|environment)(?:\.(\w+))?(.*)", field)
    if match is None or int(match[1]) >= len(made) or made[int(match[1])].WhichOneof("edit") != match[2]:
        return field
    place = match[2]
    if match[2] != "environment":
        message = getattr(made[int(match[1])], match[2])
        target = message.name if message.WhichOneof("target") == "name" else message.index
        place = f"{match[2]}s[{target!r}]"
        if match[3] in ("name", "index"):
            return place
    return place + (f".{match[3]}" if match[3] else "") + match[4]


def _fill(message: Any, values: Mapping[str, Any], place: str, problems: list[Problem]) -> None:
    fields = {name: field for name, field in message.DESCRIPTOR.fields_by_name.items() if name not in ("name", "index")}
    if not isinstance(values, Mapping) or not values:
        problems.append(Problem(place, repr(values), "a dict with any of " + ", ".join(fields)))
        return
    for name, value in values.items():
        where = f"{place}.{name}"
        field = fields.get(name)
        try:
            if field is None:
                problems.append(Problem(where, repr(value), "any of " + ", ".join(fields)))
            elif name == "transform":
                message.transform.extend(_numbers(value))
            elif field.message_type is not None:
                vector = getattr(message, name)
                vector.SetInParent()
                vector.x, vector.y, vector.z = read_vector(where, value)
            else:
                setattr(message, name, value)
        except HeliographError as error:
            problems.extend(error.problems)
        except (TypeError, ValueError):
            allowed = (
                "12 numbers, or an array of 3x4 or 4x4"
                if name == "transform"
                else "a number"
                if name != "relative"
                else "True or False"
            )
            problems.append(Problem(where, repr(value), allowed))


def _numbers(transform: Iterable[Any]) -> list[float]:
    """Row by row; the last row of a 4x4 matrix must be 0 0 0 1."""
    import numpy as np

    matrix = np.asarray(transform, np.float64)
    if matrix.shape == (4, 4):
        if not np.array_equal(matrix[3], [0, 0, 0, 1]):
            raise ValueError
        matrix = matrix[:3]
    if matrix.size != 12 or matrix.shape not in ((12,), (3, 4)):
        raise ValueError
    return [float(value) for value in matrix.ravel()]
