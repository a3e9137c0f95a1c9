"""Client of the Heliograph render daemon.

    import heliograph as hg
    with hg.serve() as c:
        image = c.render("cornell-box.gltf", size=(640, 360), until=hg.Error(0.01))
        image.save("box.exr")
        print(image.rgb.shape, image.sigma.mean())

connect() or serve() answer a Client; it loads scenes, renders stills, submits jobs, some of
which outlive the program, opens sessions and compares modes.
heliograph.aio has the same names for asyncio. README.md of this package is the manual.
"""

from ._version import __version__
from .budget import Error, Limit, Samples, Seconds, Until
from .camera import Camera
from .client import Client, Scene, compare, connect, serve
from .comparison import Comparison, Disk
from .daemon import Daemon
from .errors import (
    BrokenTile,
    Cancelled,
    DeadlineExceeded,
    FailedPrecondition,
    HeliographError,
    HeliographWarning,
    Internal,
    InvalidArgument,
    MissingChannel,
    MissingPackage,
    NotFound,
    PermissionDenied,
    Problem,
    RenderFailed,
    ResourceExhausted,
    Unavailable,
    Unimplemented,
)
from .exr import Window
from .frames import Frame
from .image import Image
from .job import Job
from .kept_job import KeptJob
from .kept_jobs import JobEvent, JobInfo, JobResult, TimeLeft
from .replay import Replay
from .scene import Details, Light, Material, Object, ServerInfo
from .session import Session
from .settings import CHANNELS, Settings
from .stats import Stats

__all__ = [
    "BrokenTile",
    "CHANNELS",
    "Camera",
    "Cancelled",
    "Client",
    "Comparison",
    "Daemon",
    "DeadlineExceeded",
    "Details",
    "Disk",
    "Error",
    "FailedPrecondition",
    "Frame",
    "HeliographError",
    "HeliographWarning",
    "Image",
    "Internal",
    "InvalidArgument",
    "Job",
    "JobEvent",
    "JobInfo",
    "JobResult",
    "KeptJob",
    "Light",
    "Limit",
    "Material",
    "MissingChannel",
    "MissingPackage",
    "NotFound",
    "Object",
    "PermissionDenied",
    "Problem",
    "RenderFailed",
    "Replay",
    "ResourceExhausted",
    "Samples",
    "Scene",
    "Seconds",
    "ServerInfo",
    "Session",
    "Settings",
    "Stats",
    "TimeLeft",
    "Unavailable",
    "Unimplemented",
    "Until",
    "Window",
    "__version__",
    "compare",
    "connect",
    "serve",
]
