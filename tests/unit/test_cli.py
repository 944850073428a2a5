"""The command line: names, options, exit codes, one sentence for every error."""

import json
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from farfield.__main__ import COMMANDS, main
from farfield.options import option_name, read_settings
from farfield_core.errors import BadInputError
from farfield_core.settings import BakeSettings
from farfield_core.store import Store

from tests.unit.walks import scene_info


@pytest.fixture(autouse=True)
def _no_settings_from_outside(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("STORE", "JOBS", *(field.upper() for field in BakeSettings.model_fields)):
        monkeypatch.delenv(f"FARFIELD_{name}", raising=False)


def last_line(text: str) -> Any:
    return json.loads(text.rstrip("\n").rsplit("\n", 1)[-1])


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "farfield", *arguments],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_layers_says_what_the_paper_says(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["layers", "--cell-size", "14", "--resolution", "512", "--layers", "64", "--json"]
    assert main(arguments) == 0
    result = last_line(capsys.readouterr().out)
    assert set(result) == {"layers", "borders", "near_field"}
    assert len(result["layers"]) == len(result["borders"]) == 64
    assert result["near_field"] == pytest.approx(59.11, abs=0.005)
    assert result["borders"][-1] == result["near_field"]
    assert result["layers"] == sorted(result["layers"], reverse=True)


def test_layers_options_reach_the_placement(capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        main(
            ["layers", "--cell-size", "4,2,6", "--alpha", "0.004", "--gap-texels", "none", "--json"]
        )
        == 0
    )
    settings = BakeSettings(cell_size=(4, 2, 6), alpha=0.004, gap_texels=None)
    result = last_line(capsys.readouterr().out)
    assert tuple(result["layers"]) == settings.place().layers


def test_layers_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["layers", "--layers", "3"]) == 0
    out = capsys.readouterr().out
    assert len(re.findall(r"(?m)^ +[012] ", out)) == 3
    assert "The near field reaches" in out


def test_environment_and_options(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FARFIELD_LAYERS", "5")
    assert main(["layers", "--json"]) == 0
    assert len(last_line(capsys.readouterr().out)["layers"]) == 5
    assert main(["layers", "--json", "--layers", "7"]) == 0
    assert len(last_line(capsys.readouterr().out)["layers"]) == 7


@pytest.mark.parametrize("name", BakeSettings.model_fields)
def test_every_setting_has_an_option_that_explains_itself(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert BakeSettings.model_fields[name].description
    for command in ("plan", "bake", "demo"):
        assert main([command, "--help"]) == 0
        assert f"{option_name(name)} " in capsys.readouterr().out


def test_settings_from_texts() -> None:
    given: dict[str, str | None] = {
        "cell_size": "14",
        "layers": "12",
        "near": None,
        "alpha": "none",
        "gap_texels": "1.5",
        "visibility": "off",
    }
    expected = BakeSettings(
        cell_size=(14, 14, 14), layers=12, alpha=None, gap_texels=1.5, visibility="off"
    )
    assert read_settings(given) == expected
    assert read_settings({"near": "20", "cell_size": "1,2,3"}).cell_size == (1, 2, 3)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("cell_size", "a"),
        ("cell_size", "1,2"),
        ("cell_size", "0"),
        ("cell_size", "nan"),
        ("layers", "0"),
        ("layers", "1.5"),
        ("resolution", "100000"),
        ("quads", "curved"),
        ("near", "1"),
        ("alpha", "2"),
        ("gap_texels", "-1"),
        ("visibility", "maybe"),
        ("grower", "greedy"),
        ("renderer", "pyrender"),
        ("supersample", "2"),
    ],
)
def test_bad_settings_are_one_sentence(name: str, text: str) -> None:
    with pytest.raises(BadInputError) as error:
        read_settings({name: text})
    assert "\n" not in str(error.value)
    assert name in str(error.value) or option_name(name) in str(error.value)


def test_errors_are_one_sentence_and_an_exit_code(tmp_path: Path) -> None:
    corridor = tmp_path / "c.json"
    corridor.write_text('{"box": {"min": [0, 0, 0], "max": [1, 1, 1]}}')
    text = tmp_path / "model.txt"
    text.write_text("x")
    out = tmp_path / "out"
    for arguments, code, words in [
        (["bake", "x.glb", "--corridor", "none.json", "--out", str(out)], 2, "cannot be read"),
        (["bake", "x.glb", "--corridor", str(corridor), "--out", str(out)], 3, "no model file"),
        (["bake", str(text), "--corridor", str(corridor), "--out", str(out)], 3, "give one of"),
        (["bake", "0123", "--corridor", str(corridor), "--out", str(out)], 4, "no scene 0123"),
        (["plan", "0123", "--corridor", str(corridor), "--store", str(out)], 4, "no store"),
        (["layers", "--layers", "0"], 2, "layers"),
        (["shoot", "nothing", "--eye", "1,2", "--look", "0,0", "--out", "p.png"], 2, "--eye"),
        (["shoot", "nothing", "--eye", "1,2,3", "--look", "0,0", "--out", "p.png"], 4, "nothing"),
    ]:
        result = run(*arguments)
        assert result.returncode == code, result.stderr
        assert result.stderr.count("\n") == 1, result.stderr
        assert words in result.stderr
        assert result.stdout == ""
    assert not out.exists()


def test_a_wrong_option_is_told_as_usual() -> None:
    result = run("layers", "--colour", "red")
    assert result.returncode == 2
    assert "No such option" in result.stderr


def test_help_and_version() -> None:
    result = run("--help")
    assert result.returncode == 0
    assert all(name in result.stdout for name in COMMANDS)
    assert run("--version").stdout.startswith("farfield, version ")


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_a_module(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([name, "--help"]) == 0
    assert "Usage:" in capsys.readouterr().out


def test_plan(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    info = scene_info()
    store = Store.open(tmp_path)
    store.put(f"scenes/{info.id}/prepared/scene.json", info.model_dump_json().encode())
    corridor = tmp_path / "c.json"
    corridor.write_text('{"box": {"min": [0, 0, 0], "max": [35, 14, 28]}}')
    arguments = ["plan", info.id, "--corridor", str(corridor), "--store", str(tmp_path)]
    before = sorted(tmp_path.rglob("*"))
    assert main([*arguments, "--cell-size", "14", "--json"]) == 0
    result = last_line(capsys.readouterr().out)
    assert result["cells"] == math.ceil(35 / 14) * 1 * 2
    assert result["near_field"] == pytest.approx(59.11, abs=0.005)
    assert {"megabytes", "seconds", "quads", "layers"} <= set(result)
    assert main(arguments) == 0
    assert "near field" in capsys.readouterr().out
    assert sorted(tmp_path.rglob("*")) == before
