"""From geometry to texels: one interface, several renderers."""

from __future__ import annotations

from typing import Literal

from farfield_core.scene import PreparedScene

from farfield_worker.render.interface import FaceTexels, Renderer
from farfield_worker.render.supersample import Supersampled

__all__ = ["FaceTexels", "Renderer", "open_renderer"]


def open_renderer(
    name: Literal["moderngl", "pyrender"], scene: PreparedScene, supersample: int = 1
) -> Renderer:
    """Open the renderer called `name` (`BakeSettings.renderer`) on a prepared scene.

    `supersample` samples each way make one texel. Call this in the process that draws, never before
    a fork.
    """
    renderer = _open(name, scene)
    return renderer if supersample == 1 else Supersampled(renderer, supersample)


def _open(name: Literal["moderngl", "pyrender"], scene: PreparedScene) -> Renderer:
    # Each is imported only when asked for: pyrender is slow to import and changes the environment.
    if name == "pyrender":
        from farfield_worker.render.pyrender_renderer import PyrenderRenderer  # noqa: PLC0415

        return PyrenderRenderer(scene)
    from farfield_worker.render.culled import CulledRenderer  # noqa: PLC0415

    return CulledRenderer(scene)
