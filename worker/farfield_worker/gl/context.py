"""The process's one OpenGL context, and the few calls that moderngl does not wrap.

Depth is reversed everywhere: clip space runs over [0, 1] (glClipControl), a point at distance Z
along the camera's axis gets depth near / Z in a 32-bit float buffer that is cleared to 0. That is
an infinite far plane with the float's full relative precision at any distance, so surfaces
centimetres apart do not flicker even kilometres away. Of equal depths the first drawn stays.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any, Protocol

import moderngl

_GL_LOWER_LEFT = 0x8CA1
_GL_ZERO_TO_ONE = 0x935F
_GL_RENDERBUFFER = 0x8D41
_GL_DEPTH_COMPONENT32F = 0x8CAC
_GL_TEXTURE_2D = 0x0DE1
_GL_TEXTURE_WRAP = {"u": 0x2802, "v": 0x2803}
_GL_WRAP_MODES = {"repeat": 0x2901, "clamp": 0x812F, "mirror": 0x8370}


@cache
def shared() -> moderngl.Context:
    """Return the context of this process, created on first use; never call this before a fork."""
    options: dict[str, Any] = {"standalone": True, "backend": "egl", "require": 450}
    context = moderngl.create_context(**options)
    with context:
        _call("glClipControl", _GL_LOWER_LEFT, _GL_ZERO_TO_ONE)
        context.depth_func = ">"
    return context


@contextmanager
def current() -> Iterator[moderngl.Context]:
    """Make the shared context current; what is created in it must be released in it."""
    context = shared()
    with context:
        yield context


@cache
def _idle() -> moderngl.Framebuffer:
    """What is bound while nothing is drawn."""
    return shared().simple_framebuffer((1, 1))


class Releasable(Protocol):
    """Anything that the GPU holds."""

    def release(self) -> None:
        """Free it."""
        ...


def release(*things: Releasable) -> None:
    """Free things in the current context; releasing twice does nothing."""
    for thing in things:
        thing.release()


def release_framebuffer(framebuffer: moderngl.Framebuffer) -> None:
    """Free a framebuffer and its attachments."""
    # moderngl binds again what was bound before; it must not be something deleted.
    _idle().use()
    attachments = (*framebuffer.color_attachments, framebuffer.depth_attachment)
    framebuffer.release()
    for attachment in attachments:
        if attachment is not None:
            attachment.release()


def cull_back_faces(context: moderngl.Context, cull: bool) -> None:
    """Draw both sides of triangles, or only their fronts."""
    if cull:
        context.enable(moderngl.CULL_FACE)
    else:
        context.disable(moderngl.CULL_FACE)


def device_name(context: moderngl.Context) -> str:
    """GL vendor, renderer and version, for logs."""
    info = context.info
    return f"{info['GL_VENDOR']} {info['GL_RENDERER']} {info['GL_VERSION']}"


def float_depth(context: moderngl.Context, size: tuple[int, int]) -> moderngl.Renderbuffer:
    """Return a 32-bit float depth buffer of `size` (width, height)."""
    # moderngl knows 24-bit depth only; its renderbuffer is given new storage.
    buffer = context.depth_renderbuffer(size)
    _call("glBindRenderbuffer", _GL_RENDERBUFFER, buffer.glo)
    _call("glRenderbufferStorage", _GL_RENDERBUFFER, _GL_DEPTH_COMPONENT32F, *size)
    return buffer


def set_wrap(texture: moderngl.Texture, wrap_u: str, wrap_v: str) -> None:
    """Set a texture's wrap modes, each "repeat", "clamp" or "mirror"."""
    _call("glBindTexture", _GL_TEXTURE_2D, texture.glo)
    for axis, wrap in (("u", wrap_u), ("v", wrap_v)):
        _call("glTexParameteri", _GL_TEXTURE_2D, _GL_TEXTURE_WRAP[axis], _GL_WRAP_MODES[wrap])


def _call(name: str, *arguments: int) -> None:
    _function(name, len(arguments))(*arguments)


@cache
def _function(name: str, arguments: int) -> Any:
    """One of the GL functions above; all of them take 32-bit integers and return nothing."""
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    address = egl.eglGetProcAddress(name.encode())
    return ctypes.CFUNCTYPE(None, *[ctypes.c_uint32] * arguments)(address)
