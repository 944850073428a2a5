"""From geometry to texels: one interface, several renderers."""

from __future__ import annotations

from typing import Literal

from farfield_core.scene import PreparedScene

from farfield_worker.render.interface import FaceTexels, Renderer

__all__ = ["FaceTexels", "Renderer", "open_renderer"]


def open_renderer(name: Literal["moderngl", "pyrender"], scene: PreparedScene) -> Renderer:
    """Open the renderer called `name` (`BakeSettings.renderer`) on a prepared scene.

    Call it in the process that draws, never before a fork.
    """
    # Each is imported only when asked for: pyrender is slow to import and changes the environment.
    if name == "pyrender":
        from farfield_worker.render.pyrender_renderer import PyrenderRenderer  # noqa: PLC0415

        return PyrenderRenderer(scene)
    from farfield_worker.render.culled import CulledRenderer  # noqa: PLC0415

    return CulledRenderer(scene)
