"""`python -m farfield_worker cell` as its dispatcher runs it."""

import json
import subprocess
import sys

from farfield_core import layout

from tests.unit.cells import small_bake


def run(store, bake, requests):
    return subprocess.run(
        [sys.executable, "-m", "farfield_worker", "cell", "--store", store, "--bake", bake],
        input=requests,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def test_answers_one_line_each_until_its_input_ends(tmp_path):
    walk, store = small_bake(tmp_path)
    result = run(store.url, walk.id, "0_0_0\nnonsense\n9_9_9\n0_0_0\n")
    assert result.returncode == 0, result.stderr
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    assert len(lines) == 5
    assert lines[0]["ready"] is True
    assert lines[0]["renderer"]
    assert lines[1]["cell"] == "0_0_0"
    assert lines[1]["ok"] is True
    assert lines[1]["figures"]["quads"] > 0
    assert lines[2] == {
        "cell": "nonsense",
        "ok": False,
        "error": "'nonsense' is not a cell; cells are named i_j_k, as in 0_0_3.",
        "store": False,
    }
    assert lines[3] == {
        "cell": "9_9_9",
        "ok": False,
        "error": "The corridor has no cell 9_9_9.",
        "store": False,
    }
    # a cell that exists is success, and stays as it was
    assert lines[4]["ok"] is True
    assert store.exists(layout.cell_key(walk.id, (0, 0, 0)))


def test_a_bake_that_does_not_exist(tmp_path):
    result = run(str(tmp_path / "store"), "0123456789abcdef", "0_0_0\n")
    assert result.returncode != 0
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    assert "0123456789abcdef" in result.stderr
