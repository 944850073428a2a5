"""The light model in GLSL against its NumPy twin, function by function."""

import farfield_shading as shading
import moderngl
import numpy as np
import pytest

COUNT = 4096


@pytest.fixture(scope="module")
def context():
    context = moderngl.create_context(standalone=True, backend="egl", require=330)
    # surfaceless EGL has no default framebuffer, and Mesa wants one even for transform feedback
    context.simple_framebuffer((1, 1)).use()
    assert context.error == "GL_NO_ERROR"
    yield context
    assert context.error == "GL_NO_ERROR"
    context.release()


def evaluate(context: moderngl.Context, expression: str, **inputs: np.ndarray) -> np.ndarray:
    """Run `expression` once per row of the inputs through transform feedback: (n, 3) float32."""
    declarations = "".join(
        f"in vec{a.shape[1]} {name};\n" if a.shape[1] > 1 else f"in float {name};\n"
        for name, a in inputs.items()
    )
    program = context.program(
        vertex_shader=f"#version 330\n{shading.glsl()}\n{declarations}out vec3 result;\n"
        f"void main() {{ result = {expression}; }}",
        varyings=["result"],
    )
    for name, value in shading.uniforms(shading.default_light()).items():
        if name in program:
            program[name].value = value
    rows = len(next(iter(inputs.values())))
    buffers = [
        (context.buffer(a.astype("f4").tobytes()), f"{a.shape[1]}f", name)
        for name, a in inputs.items()
    ]
    out = context.buffer(reserve=rows * 12)
    context.vertex_array(program, buffers).transform(out, moderngl.POINTS, rows)
    return np.frombuffer(out.read(), "f4").reshape(rows, 3)


def unit_vectors(rng: np.random.Generator) -> np.ndarray:
    v = rng.normal(size=(COUNT, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def test_shade(context: moderngl.Context) -> None:
    rng = np.random.default_rng(1)
    n, base, emissive = unit_vectors(rng), rng.random((COUNT, 3)), 0.3 * rng.random((COUNT, 3))
    flag = np.arange(COUNT)[:, None] % 2
    out = evaluate(
        context, "ff_shade(base, n, emissive, flag)", base=base, n=n, emissive=emissive, flag=flag
    )
    lit = shading.shade(shading.default_light(), base, n, emissive)
    flat = shading.shade(shading.default_light(), base, n, emissive, unlit=True)
    np.testing.assert_allclose(out, np.where(flag == 0, lit, flat), atol=2e-6)


def test_transfer_function(context: moderngl.Context) -> None:
    c = np.linspace(0, 1, COUNT)[:, None]
    out = evaluate(context, "ff_to_srgb(vec3(c))", c=c)
    np.testing.assert_allclose(out, np.repeat(shading.to_srgb(c), 3, 1), atol=2e-6)
    np.testing.assert_allclose(shading.to_linear(shading.to_srgb(c)), c, atol=1e-9)


def test_sky(context: moderngl.Context) -> None:
    d = 5.0 * np.random.default_rng(2).normal(size=(COUNT, 3))
    out = evaluate(context, "ff_sky(d)", d=d)
    np.testing.assert_allclose(out, shading.sky(shading.default_light(), d), atol=1e-4)


def test_dither(context: moderngl.Context) -> None:
    x, y, a = (g.ravel() for g in np.meshgrid(range(8), range(8), np.linspace(0, 1, 64)))
    p = np.stack([x, y], 1)
    out = evaluate(context, "vec3(ff_dither(a, p + 0.5))", p=p, a=a[:, None])[:, 0]
    expected = shading.dither(a, x.astype(int), y.astype(int))
    # on the thresholds themselves float32 may fall either way
    on_threshold = np.abs((a * 16 - 0.5) - np.round(a * 16 - 0.5)) < 1e-4
    np.testing.assert_array_equal(out[~on_threshold] > 0.5, expected[~on_threshold])


def test_dither_keeps_the_average_coverage() -> None:
    y, x = np.mgrid[0:4, 0:4]
    for alpha in np.linspace(0, 1, 33):
        assert abs(shading.dither(np.full((4, 4), alpha), x, y).mean() - alpha) <= 1 / 32 + 1e-9


def test_light_constants_are_sound() -> None:
    light = shading.default_light()
    assert tuple(light) == shading.LIGHT_NAMES
    assert np.linalg.norm(light["sun_direction"]) == pytest.approx(1, abs=1e-4)
    # a white wall facing the sun must not burn out
    sun = np.array(light["sun_direction"])
    assert shading.irradiance(light, sun).max() <= 1.08
