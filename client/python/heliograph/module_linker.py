"""Joins ES modules into one, for hosts that load a page's code from a single text.

Each module becomes a function that is called once, in the order in which they need each other; its exports become an
object that the modules after it take their names from. Only the forms below are understood, at the beginning of a
line, and everything else that imports or exports is refused by file and line:

    import { a, b as c } from './x.js';      import * as x from './x.js';      import './x.js';
    export const a = ...    export function a    export class a    export { a, b as c };    export default ...
    await import('./x.js')                   the module runs when that is first reached

An export of several names, `const a = 1, b = 2`, exports the first alone. `export var` and `export let` are allowed
where nothing imports the name: importers would not see it change.
"""

from __future__ import annotations

import dataclasses
import itertools
import posixpath
import re
from collections.abc import Callable

_NAME = r"[A-Za-z_$][\w$]*"
_LIST = r"\{[^{}]*\}"
_FROM = r"(?P<quote>['\"])(?P<path>[^'\"\n]*)(?P=quote)"
_STATEMENT = re.compile(r"^(?:import|export)(?![\w$])(?!\s*[(.])", re.MULTILINE)
_IMPORT = re.compile(
    rf"import\s*(?:(?:(?P<some>{_LIST})|\*\s*as\s+(?P<all>{_NAME}))\s*from\s*)?{_FROM};?[ \t]*$", re.MULTILINE
)
_EXPORT = re.compile(
    rf"export\s+(?:(?P<default>default\s)|(?P<list>{_LIST});?[ \t]*$"
    rf"|(?P<kind>const|let|var|class|function\*?|async\s+function\*?)\s+(?P<name>{_NAME}))",
    re.MULTILINE,
)
_ITEM = re.compile(rf"({_NAME})(?:\s+as\s+({_NAME}))?")
_DYNAMIC = re.compile(rf"\bimport\s*\(\s*{_FROM}\s*\)")
_OTHER = re.compile(
    r"\bimport\s*[(.]|^[ \t]+import\s*[\w$*{'\"]|^[ \t]+export\s+[\w$*{]"
    r"|[;}]\s*import\s*['\"{*]|[;}][ \t]*export\s+[\w{*]",
    re.MULTILINE,
)
_OURS = "$module"


class LinkError(ValueError):
    """A module has what the linker does not understand, or needs what is not there."""


@dataclasses.dataclass
class _Module:
    name: str
    number: int
    body: str
    imports: list[tuple[str, str]]  # the module, and the pattern that takes its exports apart; empty: none
    exports: dict[str, str]  # exported name to the module's own
    fixed: set[str]  # own names that never change
    lazy: bool = False


class _Linker:
    def __init__(self, read: Callable[[str], str]) -> None:
        self._read = read
        self._modules: dict[str, _Module] = {}
        self._order: list[_Module] = []
        self._open: list[str] = []
        self._numbers = itertools.count()

    def add(self, name: str) -> _Module:
        if name in self._open:
            circle = " -> ".join([*self._open[self._open.index(name) :], name])
            raise LinkError(f"{circle}: modules that import each other in a circle are not linked")
        if name in self._modules:
            return self._modules[name]
        self._open.append(name)
        try:
            source = self._read(name)
        except OSError as error:
            asked = f", imported by {self._open[-2]}" if len(self._open) > 1 else ""
            raise LinkError(f"{name}: {error.strerror or error}{asked}") from None
        module = self._parse(name, source.replace("\r\n", "\n"))
        self._modules[name] = module
        self._order.append(module)
        self._open.pop()
        return module

    def _parse(self, name: str, source: str) -> _Module:
        def refuse(at: int, why: str) -> LinkError:
            line = source.count("\n", 0, at) + 1
            text = source.splitlines()[line - 1].strip()
            return LinkError(f"{name}:{line}: {why}: {text[:80]}")

        def resolve(path: str, at: int) -> str:
            target = posixpath.normpath(posixpath.join(posixpath.dirname(name), path))
            if not path.startswith(("./", "../")) or not path.endswith(".js") or target.startswith(".."):
                raise refuse(at, "the path of a module begins with ./ or ../, ends in .js and stays inside the folder")
            return target

        def items(text: str, at: int) -> list[tuple[str, str]]:
            found = []
            for part in filter(None, (part.strip() for part in text.strip("{}").split(","))):
                match = _ITEM.fullmatch(part)
                if not match:
                    raise refuse(at, "a list of names that is not understood")
                found.append((match[1], match[2] or match[1]))
            return found

        if _OURS in source:
            raise refuse(source.index(_OURS), f"names with {_OURS} are the linker's own")
        imports: list[tuple[str, str]] = []
        exports: dict[str, str] = {}
        fixed: set[str] = set()
        parts: list[str] = []
        done = 0

        def export(outside: str, inside: str, at: int) -> None:
            if outside in exports:
                raise refuse(at, f"{outside} is exported twice")
            exports[outside] = inside

        for statement in _STATEMENT.finditer(source):
            at = statement.start()
            if at < done or _inside_text(source, at):
                raise refuse(at, "a line of a comment or template that looks like a statement")
            match = _IMPORT.match(source, at)
            if match:
                target = resolve(match["path"], at)
                self.add(target)
                what = match["all"] or ""
                if match["some"]:
                    taken = items(match["some"], at)
                    for outside, _ in taken:
                        why = self._unusable(target, outside)
                        if why:
                            raise refuse(at, why)
                    what = "{ " + ", ".join(f"{outside}: {inside}" for outside, inside in taken) + " }"
                imports.append((target, what))
                parts += [source[done:at], "\n" * match[0].count("\n")]
            else:
                match = _EXPORT.match(source, at)
                if not match:
                    raise refuse(at, "a form of import or export that is not understood")
                if match["default"]:
                    export("default", f"{_OURS}Default", at)
                    parts += [source[done:at], f"const {_OURS}Default = "]
                elif match["list"]:
                    for inside, outside in items(match["list"], at):
                        export(outside, inside, at)
                        if re.search(rf"^(?:const|class|function)\s+{re.escape(inside)}\b", source, re.MULTILINE):
                            fixed.add(inside)
                    parts += [source[done:at], "\n" * match[0].count("\n")]
                else:
                    export(match["name"], match["name"], at)
                    if match["kind"] not in ("let", "var"):
                        fixed.add(match["name"])
                    parts += [source[done:at], match[0].removeprefix("export").lstrip()]
            done = match.end()
        parts.append(source[done:])
        body = "".join(parts)

        dynamic = {match.start() for match in _DYNAMIC.finditer(body)}
        for other in _OTHER.finditer(body):
            if other.start() not in dynamic:
                at = source.find(other[0].strip())
                raise refuse(max(at, 0), "a form of import or export that is not understood")

        def load(match: re.Match[str]) -> str:
            module = self.add(resolve(match["path"], source.find(match[0])))
            module.lazy = True
            return f"Promise.resolve().then(() => {_OURS}{module.number}())"

        return _Module(name, next(self._numbers), _DYNAMIC.sub(load, body), imports, exports, fixed)

    def _unusable(self, target: str, name: str) -> str:
        """Why a name of a module cannot be imported; empty: it can."""
        module = self._modules[target]
        if name not in module.exports:
            return f"{target} exports no {name}"
        if name != "default" and module.exports[name] not in module.fixed:
            return f"{name} of {target} may change, which an importer would not see"
        return ""

    def text(self, entry: _Module) -> str:
        """All modules, each after those that it needs, and the entry's exports."""
        parts = []
        for module in self._order:
            imports = ""
            for target, what in module.imports:
                needed = self._modules[target]
                value = f"{_OURS}{needed.number}{'()' if needed.lazy else ''}"
                imports += f"const {what} = {value}; " if what else f"{value}; "
            getters = "".join(f"  get {name}() {{ return {own}; }},\n" for name, own in module.exports.items())
            made = f"() => {{ {imports}\n{module.body}\nreturn Object.freeze({{\n{getters}}});\n}}"
            if module.lazy:
                made = f"((made) => () => (made ??= ({made})()))()"
            else:
                made = f"({made})()"
            parts.append(f"// {module.name}\nconst {_OURS}{module.number} = {made};\n")
        for name in entry.exports:
            begin = "export default" if name == "default" else f"export const {name} ="
            parts.append(f"{begin} {_OURS}{entry.number}.{name};\n")
        return "".join(parts)


def _inside_text(source: str, at: int) -> bool:
    """Whether a comment or a template literal is open there, by their marks."""
    before = source[:at]
    in_comment = before.rfind("/*") > before.rfind("*/")
    return in_comment or before.replace("\\`", "").count("`") % 2 == 1


def link(read: Callable[[str], str], entry: str) -> str:
    """The text of one ES module with the exports of `entry`, which needs no other.

    read: the text of a module by its path in a tree of folders, with slashes; OSError: there is none. entry: such a
    path. LinkError: what is not understood, by file and line.
    """
    linker = _Linker(read)
    return linker.text(linker.add(entry))
