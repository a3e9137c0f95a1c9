"""A session as a widget of Jupyter: Session.show(). Needs anywidget, the extra [notebook].

The widget draws with the modules of the daemon's own page. Pictures go through the kernel as the EXR files of their
tiles, so that the browser need not reach the daemon; pages.py says how many and which.
"""

from __future__ import annotations

import functools
import math
import pathlib
from typing import Any, Protocol

from .errors import Internal, MissingPackage, invalid
from .module_linker import LinkError, link
from .pages import Pages
from .session_core import SessionMethods

#: What `channel` may name: the channels of the daemon's page. A session has those of its argument `channels`.
CHANNELS = (
    "display",
    "radiance",
    "error",
    "relative",
    "displayerror",
    "samples",
    "density",
    "weight",
    "age",
    "bound",
    "albedo",
    "normal",
    "depth",
)
_STOPS = 12
_PACKAGE = pathlib.Path(__file__).resolve().parent
_ENTRY = "widget/widget.js"


def _folder(name: str) -> pathlib.Path:
    """Of the package or, for the page's modules in a checkout, beside it."""
    inside = _PACKAGE / name
    if name != "web" or inside.is_dir():
        return inside
    return _PACKAGE.parents[1] / "web"


def _read(name: str) -> str:
    folder, _, rest = name.partition("/")
    return (_folder(folder) / rest).read_text(encoding="utf-8")


@functools.cache
def front_end() -> tuple[str, str]:
    """Module and style sheet of the widget, which need no other file. Internal: the package lacks some."""
    try:
        return link(_read, _ENTRY), _read("widget/widget.css")
    except (LinkError, OSError) as error:
        raise Internal(f"the widget's modules are damaged or not installed: {error}", problems=()) from None


class Widget(Protocol):
    """What show() answers: an anywidget.AnyWidget with these names besides."""

    exposure: float  # stops, [-12, 12]
    channel: str  # one of CHANNELS; empty: by what the session has

    def close(self) -> None:
        """Takes the widget off every page and ends its traffic. The session goes on."""


@functools.cache
def _widget_class() -> Any:
    try:
        import anywidget
        import traitlets
    except ImportError:
        raise MissingPackage(
            "show() needs the package anywidget, which is not installed: pip install 'heliograph[notebook]', "
            "or pip install anywidget",
            problems=(),
        ) from None

    class SessionWidget(anywidget.AnyWidget):  # type: ignore[misc]
        """A session's picture. exposure: stops; channel: what is shown, empty: by what the session has.

        close() ends the widget; the session goes on.
        """

        _esm, _css = front_end()
        exposure = traitlets.Float(0).tag(sync=True)
        channel = traitlets.Unicode("").tag(sync=True)

        def __init__(self, session: SessionMethods, **traits: Any) -> None:
            super().__init__(**traits)
            self.pages = Pages(session, self.send)
            self.on_msg(lambda _, message, buffers: self.pages.receive(message))

        @traitlets.validate("exposure")  # type: ignore[untyped-decorator]
        def _check_exposure(self, proposal: Any) -> float:
            return _read_exposure(proposal["value"])

        @traitlets.validate("channel")  # type: ignore[untyped-decorator]
        def _check_channel(self, proposal: Any) -> str:
            return _read_channel(proposal["value"] or None)

        def close(self) -> None:
            """Takes the widget off every page and ends its traffic. The session goes on."""
            pages = getattr(self, "pages", None)
            if pages is not None:
                pages.close()
            super().close()

    return SessionWidget


def _read_exposure(value: Any) -> float:
    try:
        stops = float(value)
    except (TypeError, ValueError):
        stops = math.nan
    if not -_STOPS <= stops <= _STOPS:
        raise invalid("exposure", value, f"[{-_STOPS}, {_STOPS}] stops")
    return stops


def _read_channel(value: str | None) -> str:
    if value is not None and value not in CHANNELS:
        raise invalid("channel", value, ", ".join(CHANNELS))
    return value or ""


def show(session: SessionMethods, *, exposure: float = 0, channel: str | None = None) -> Widget:
    """A widget with the session's picture, an anywidget.AnyWidget; display it as a cell's last value, or by display().

    Drag: orbit; shift or right drag: pan; wheel and pinch: towards the cursor; double click with the channel depth:
    orbit around that point. A session may have several widgets, and a widget may be on several pages. The session is
    held while a page shows it, and the widget says so when it ends.

    exposure: stops, [-12, 12]. channel: one of heliograph.notebook.CHANNELS; None: display where the session has it,
    else radiance. Both are attributes of the widget, too.
    MissingPackage: anywidget is not installed. InvalidArgument. FailedPrecondition: the session is closed, or 64
    widgets show it.
    """
    session._core.check()
    traits = {"exposure": _read_exposure(exposure), "channel": _read_channel(channel)}
    widget: Widget = _widget_class()(session, **traits)
    return widget
