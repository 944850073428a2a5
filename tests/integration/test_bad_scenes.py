"""Bad input through the public commands: it works, or one sentence says what to change.

Triangles that are none are left out, a model of nothing else is refused. What a cell is worth in
odd places, inside solid geometry or far from any, is in `tests/unit/test_cell_odd.py`.
"""

import itertools
import json
import subprocess
import sys
from pathlib import Path

import pytest
from farfield_core.store import Store

#: points in a line, one that is no number, one beyond any scene
BAD_POINTS = "v 5 5 30\nv 6 6 30\nv 7 7 30\nv nan 0 20\nv 0 inf 20\n"
#: faces of them, from the number of the first: one point, two, three in a line, no number, infinite
BAD_FACES = ((0, 0, 0), (0, 1, 1), (0, 1, 2), (0, 1, 3), (0, 2, 4))
CUBE = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))


def model(file: Path, places: list[tuple[float, float]], bad: bool) -> Path:
    """Cubes of 4 m at places (x, z), and bad faces."""
    lines = []
    for number, (x, z) in enumerate(places):
        for a, b, c in itertools.product((-2, 2), repeat=3):
            lines.append(f"v {x + a} {b} {z + c}")
        lines += ["f " + " ".join(str(8 * number + n) for n in face) for face in CUBE]
    if bad:
        first = 8 * len(places) + 1
        lines += [BAD_POINTS]
        lines += ["f " + " ".join(str(first + n) for n in face) for face in BAD_FACES]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def farfield(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "farfield", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def bake(scene: Path, *settings: object) -> subprocess.CompletedProcess[str]:
    corridor = scene.with_suffix(".json")
    corridor.write_text('{"box": {"min": [-1, -1, -1], "max": [1, 1, 1]}}', encoding="utf-8")
    return farfield(
        *("bake", scene, "--corridor", corridor, "--out", scene.parent / "out", "--cell-size", 2),
        *("--layers", 16, "--jobs", 1, "--json", *settings),
    )


def test_degenerate_triangles_are_left_out_and_the_rest_is_baked(tmp_path: Path) -> None:
    places = [(-40, 0), (40, 0), (0, -40), (0, 40)]
    scene = model(tmp_path / "dirty.obj", places, bad=True)
    for quads in ("slanted", "layers"):
        # not a power of two
        result = bake(scene, "--quads", quads, "--resolution", 75)
        assert result.returncode == 0, result.stderr
        figures = json.loads(result.stdout.splitlines()[-1])
        assert (figures["cells"], figures["failed"]) == (1, 0)
        assert figures["quads"] >= len(places)
        assert figures["texels"] > 0
    store = Store.open(tmp_path / "out", create=False)
    (info,) = [key for key in store.list("scenes/") if key.endswith("/scene.json")]
    assert json.loads(store.get(info))["triangles"] == 12 * len(places)


def test_a_model_of_degenerate_triangles_only_is_refused(tmp_path: Path) -> None:
    result = bake(model(tmp_path / "none.obj", [], bad=True), "--resolution", 64)
    assert result.returncode == 3
    last = result.stderr.strip().splitlines()[-1]
    assert last == "none.obj cannot be read: it holds no triangles."
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        (("--resolution", 15), "resolution"),
        (("--layers", 0), "layers"),
        (("--cell-size", 0), "cell_size"),
        (("--near", 0.5), "near 0.5 lies inside the cell; use more than 1"),
    ],
    ids=str,
)
def test_settings_that_cannot_be_are_refused_before_anything_is_read(
    tmp_path: Path, settings: tuple[object, ...], word: str
) -> None:
    result = bake(tmp_path / "absent.obj", *settings)
    assert result.returncode == 2
    assert word in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()
