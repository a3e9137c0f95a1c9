"""Puts what is made or lies elsewhere into the wheel and the source distribution: the stubs of the protocol,
heliograph/v1, and the modules of the daemon's page that the widget for notebooks is made of, heliograph/web. A wheel
that is built from a checkout also notes its path, in heliograph/_checkout.py, so that serve() finds a daemon there.

In a checkout protoc makes the stubs from ../../proto: into a temporary folder, or for an editable install into the
package; the modules are those of ../web. A source distribution has both already.
"""

import importlib.util
import pathlib
import shutil
import subprocess
import sys
import tempfile

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PACKAGES = "protobuf-compiler and protobuf-compiler-grpc"


def generate(protos: pathlib.Path, folder: pathlib.Path) -> None:
    """Writes folder/heliograph/v1 from protos/heliograph/v1/*.proto. SystemExit says what is missing."""
    protoc, plugin = shutil.which("protoc"), shutil.which("grpc_python_plugin")
    if not protoc or not plugin:
        missing = " and ".join(name for name, path in (("protoc", protoc), ("grpc_python_plugin", plugin)) if not path)
        sys.exit(
            f"heliograph: {missing} not found; in a checkout the package's stubs are made by them. On Debian install "
            f"{PACKAGES}; a source distribution or a wheel needs neither."
        )
    names = sorted(str(path.relative_to(protos)) for path in (protos / "heliograph" / "v1").glob("*.proto"))
    services = [name for name in names if "\nservice " in (protos / name).read_text()]
    subprocess.run([protoc, f"-I{protos}", f"--python_out={folder}", f"--pyi_out={folder}", *names], check=True)
    subprocess.run(
        [protoc, f"-I{protos}", f"--plugin=protoc-gen-grpc_python={plugin}", f"--grpc_python_out={folder}", *services],
        check=True,
    )
    (folder / "heliograph" / "v1" / "__init__.py").write_text(
        '"""Messages and stubs of the protocol heliograph.v1, as protoc makes them."""\n'
    )


def page_modules(root: pathlib.Path, web: pathlib.Path) -> list[str]:
    """Paths below web of all that the widget is made of, licences included. SystemExit says what is damaged."""
    spec = importlib.util.spec_from_file_location("module_linker", root / "heliograph" / "module_linker.py")
    linker = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(linker)
    read_names = []

    def read(name: str) -> str:
        folder, _, rest = name.partition("/")
        if folder == "web":
            read_names.append(rest)
        return ((web if folder == "web" else root / "heliograph" / folder) / rest).read_text(encoding="utf-8")

    try:
        linker.link(read, "widget/widget.js")
    except linker.LinkError as error:
        sys.exit(f"heliograph: the widget for notebooks cannot be put together: {error}")
    licences = [name.removesuffix(".js") + ".LICENSE" for name in read_names if name.startswith("vendor/")]
    return read_names + licences


class Stubs(BuildHookInterface):
    def initialize(self, version, build_data):
        root = pathlib.Path(self.root)
        protos = (root / ".." / ".." / "proto").resolve()
        stubs = root / "heliograph" / "v1"
        if (protos / "heliograph" / "v1").is_dir():
            if version == "editable":
                generate(protos, root)
                return
            self.temporary = tempfile.TemporaryDirectory(prefix="heliograph-stubs-")
            generate(protos, pathlib.Path(self.temporary.name))
            stubs = pathlib.Path(self.temporary.name) / "heliograph" / "v1"
        elif not (stubs / "__init__.py").is_file():
            sys.exit(
                f"heliograph: neither the stubs ({stubs}) nor the protocol ({protos}) are there; build from a "
                "checkout or from a source distribution"
            )
        for path in sorted(stubs.iterdir()):
            if path.suffix in (".py", ".pyi"):
                build_data["force_include"][str(path)] = f"heliograph/v1/{path.name}"
        if self.target_name == "wheel" and (protos / "heliograph" / "v1").is_dir() and hasattr(self, "temporary"):
            note = pathlib.Path(self.temporary.name) / "checkout.py"
            note.write_text(
                '"""The checkout that this package was built from, where its daemon may have been built, too."""\n\n'
                f"CHECKOUT = {str(root.parents[1].resolve())!r}\n"
            )
            build_data["force_include"][str(note)] = "heliograph/_checkout.py"
        web = (root / ".." / "web").resolve()
        if (web / "picture").is_dir() and not (root / "heliograph" / "web").is_dir():
            for name in page_modules(root, web):
                build_data["force_include"][str(web / name)] = f"heliograph/web/{name}"

    def finalize(self, version, build_data, artifact):
        if hasattr(self, "temporary"):
            self.temporary.cleanup()
