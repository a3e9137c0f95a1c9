"""A sample that was traced again."""

from __future__ import annotations

from collections.abc import Sequence

from .camera import Vector
from .v1 import replay_pb2 as messages


class Replay:
    """What a sample did, vertex by vertex. The protocol's message, with every value of every vertex, is in
    `message`."""

    def __init__(self, message: messages.ReplaySampleResponse) -> None:
        self.message = message

    @property
    def pixel(self) -> tuple[int, int]:
        """(x, y) in the film."""
        return self.message.sample.sample.x, self.message.sample.sample.y

    @property
    def radiance(self) -> Vector:
        """What the film was offered, linear Rec.709; may be NaN or infinite."""
        return self.message.radiance.x, self.message.radiance.y, self.message.radiance.z

    @property
    def finite(self) -> bool:
        """Whether the radiance is neither NaN nor infinite."""
        return self.message.finite

    @property
    def first_not_finite(self) -> str:
        """Where a value first was NaN or infinite; empty: none was."""
        if not self.message.first_not_finite:
            return ""
        path = "light vertex" if self.message.first_not_finite_on_light_path else "vertex"
        return f"{path} {self.message.first_not_finite_vertex}: {self.message.first_not_finite}"

    @property
    def note(self) -> str:
        """A reason why bits may differ from those rendered; empty: none."""
        return self.message.note

    @property
    def vertices(self) -> Sequence[messages.TracedVertex]:
        """The vertices of the path, the first 1000."""
        return self.message.vertices

    def __str__(self) -> str:
        def shown(v: messages.Vec3f | messages.TracedVertex) -> str:
            return f"({v.x:.9g}, {v.y:.9g}, {v.z:.9g})"  # type: ignore[union-attr]

        sample = self.message.sample
        lines = [
            f"pixel {sample.sample.x},{sample.sample.y}, half {sample.sample.half}, sample {sample.sample.index} of a "
            f"{sample.width}x{sample.height} film, seed {sample.seed}",
            f"radiance {shown(self.message.radiance)}"
            + ("" if self.finite else f": invalid, first not finite at {self.first_not_finite}"),
        ]
        for vertex in self.vertices:
            where = (
                f"hit '{vertex.instance}' of '{vertex.material}' at {vertex.distance:.9g}"
                if vertex.hit
                else "left the scene"
            )
            lines.append(f"vertex {vertex.number}: {where}, throughput {shown(vertex.throughput)}, {vertex.outcome}")
        return "\n".join(lines)
