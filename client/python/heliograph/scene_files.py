"""The files that make up a scene on this disk: the scene file and those that it names."""

from __future__ import annotations

import dataclasses
import json
import math
import os
import pathlib
import posixpath
import re
import struct
import urllib.parse
import xml.etree.ElementTree as xml
from collections.abc import Iterable, Sequence

from .errors import NotFound, invalid

_GLB_JSON_CHUNK = 0x4E4F534A  # "JSON", little endian
_INCLUDE_DEPTH = 8  # as the daemon's loader has it
_MOST_TEXT = 1 << 16  # defaults of defaults could double without end
_LARGEST_RADIANCE = 3.4028234663852886e38


@dataclasses.dataclass(frozen=True)
class SceneFile:
    name: str  # within the upload: relative, "/"-separated, unique
    path: pathlib.Path
    bytes: int


@dataclasses.dataclass(frozen=True)
class LocalScene:
    main_file: str  # always files[0].name
    files: tuple[SceneFile, ...]
    environment: str  # what LoadScene wants: "", "R,G,B" or the name of a file of the upload

    @property
    def total_bytes(self) -> int:
        return sum(file.bytes for file in self.files)


def collect(path: str | os.PathLike[str], environment: str | os.PathLike[str] | Sequence[float] | None) -> LocalScene:
    """The scene file and every file that it names (glTF's URIs, Mitsuba's file names) below its own folder.

    Names that leave that folder and files that do not exist are left out: the daemon, which knows whether they matter,
    reports them. NotFound: no such scene file. InvalidArgument: the environment.
    """
    scene = pathlib.Path(path)
    if not scene.is_file():
        raise NotFound(f"{scene}: {'is not a regular file' if scene.exists() else 'no such file'}", problems=())
    try:
        names = _names_in(scene)
    except OSError as error:
        raise NotFound(f"{scene}: cannot be read ({error.strerror})", problems=()) from None
    files = {scene.name: SceneFile(scene.name, scene, scene.stat().st_size)}
    for uri in names:
        name = relative_name(uri)
        if name is None or name in files:
            continue
        # Some exporters leave a "%" of the name as it is: the file itself decides.
        for candidate in (name, uri):
            there = scene.parent / candidate
            if ".." not in candidate and _is_file(there):
                files[name] = SceneFile(name, there, there.stat().st_size)
                break
    text = environment_text(environment)
    if text and names_map(text):
        there = pathlib.Path(text)
        if not _is_file(there):
            raise invalid("environment", text, "a file, or three numbers R,G,B in [0, 3.4e38]")
        name = there.name
        while name in files:
            name = "environment/" + name
        files[name] = SceneFile(name, there, there.stat().st_size)
        text = name
    return LocalScene(scene.name, tuple(files.values()), text)


def environment_text(environment: str | os.PathLike[str] | Sequence[float] | None) -> str:
    """As the protocol has it: "", "R,G,B" or a path."""
    if environment is None:
        return ""
    if isinstance(environment, (str, os.PathLike)):
        return os.fspath(environment)
    try:
        r, g, b = (float(part) for part in environment)
    except (TypeError, ValueError):
        raise invalid("environment", environment, "a file, or three numbers R,G,B in [0, 3.4e38]") from None
    text = f"{r!r},{g!r},{b!r}"
    names_map(text)
    return text


def names_map(text: str) -> bool:
    """Whether an environment is a file's name; False: R,G,B. InvalidArgument: numbers, but not three in [0, 3.4e38]."""
    numbers = []
    for part in text.split(","):
        try:
            numbers.append(float(part))
        except ValueError:
            return True
    if len(numbers) == 3 and all(math.isfinite(number) and 0 <= number <= _LARGEST_RADIANCE for number in numbers):
        return False
    raise invalid("environment", text, "a file, or three numbers R,G,B in [0, 3.4e38]")


def relative_name(uri: str) -> str | None:
    """The path within the scene's folder that a percent-encoded URI names; None: it names none."""
    text = urllib.parse.unquote(uri, errors="surrogateescape")
    if not text or any(character in text for character in "\\:\0") or text.endswith("/"):
        return None
    path = posixpath.normpath(text)
    if path.startswith("/") or path in (".", "..") or path.startswith("../"):
        return None
    try:
        path.encode()
    except UnicodeEncodeError:
        return None
    return path


def _is_file(path: pathlib.Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _names_in(scene: pathlib.Path) -> list[str]:
    with open(scene, "rb") as file:
        head = file.read(20)
        if head.startswith(b"glTF") and len(head) == 20:
            length, kind = struct.unpack_from("<II", head, 12)
            if kind != _GLB_JSON_CHUNK or length > scene.stat().st_size - 20:
                return []
            return _gltf_uris(file.read(length))
        start = (head + file.read(4096)).removeprefix(b"\xef\xbb\xbf").lstrip()
        if start.startswith(b"<"):
            finder = _MitsubaFiles(scene.parent)
            finder.read(scene, 0)
            return list(finder.files)
        if start.startswith(b"{"):
            file.seek(0)
            return _gltf_uris(file.read())
    return []


_URI_KEY = re.compile(rb'"(?:uri|image)"\s*:\s*"(?!data:)')
_STRING = re.compile(rb'(?:[^"\\]++|\\.)*+"', re.DOTALL)
_STEP = 1 << 20  # bytes between which other threads get their turn
_OVERLAP = 256  # longer than a key with the white space about its colon


def _gltf_uris(text: bytes) -> list[str]:
    """Values of the keys "uri" and "image". Found without a parser, which would hold all threads of the process for the
    time that a large file takes. In a file that is broken it may find any of them: the daemon says where it is."""
    found: dict[str, None] = {}
    for start in range(0, len(text), _STEP):
        for key in _URI_KEY.finditer(text, start, min(len(text), start + _STEP + _OVERLAP)):
            value = _STRING.match(text, key.end())
            if value is None:
                continue
            try:
                name = json.loads(b'"' + value[0])
            except (ValueError, UnicodeDecodeError):
                continue
            if name and not name.startswith("data:"):
                found[name] = None
    return list(found)


class _MitsubaFiles:
    """Names of files in Mitsuba's XML, with its <default>, <path> and <include>."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.files: dict[str, None] = {}
        self._folder = folder
        self._prefixes: list[str] = []
        self._parameters: dict[str, str] = {}
        self._read: set[pathlib.Path] = set()

    def read(self, path: pathlib.Path, depth: int) -> None:
        if depth > _INCLUDE_DEPTH or path in self._read:
            return
        self._read.add(path)
        try:
            root = xml.parse(path).getroot()
        except (OSError, xml.ParseError, ValueError):
            return  # the daemon says what is wrong
        included = list(self._walk(root))
        for name in included:
            for prefix in ("", *self._prefixes):
                relative = relative_name(prefix + name)
                if relative is not None:
                    self.read(self._folder / relative, depth + 1)

    def _walk(self, root: xml.Element) -> Iterable[str]:
        for node in root.iter():
            value = self._replaced(node.get("value", ""))
            if node.tag == "path":
                self._prefixes.append(value if not value or value.endswith("/") else value + "/")
            elif node.tag == "default":
                self._parameters.setdefault(node.get("name", ""), value)
            elif node.tag == "include":
                name = self._replaced(node.get("filename", ""))
                self._add(name)
                yield name
            elif node.get("name") == "filename":
                self._add(value)

    def _replaced(self, text: str) -> str:
        for key in sorted(self._parameters, reverse=True):  # longer names first: $width before $w
            if "$" + key in text and len(text) <= _MOST_TEXT:
                text = text.replace("$" + key, self._parameters[key])
        return text

    def _add(self, name: str) -> None:
        if not name:
            return
        self.files[name] = None
        for prefix in self._prefixes:
            relative = relative_name(prefix + name)
            if relative is not None and _is_file(self._folder / relative):
                self.files[relative] = None
