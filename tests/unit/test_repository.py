"""Rules for the whole tree: imports point one way, files are short and name no machine."""

from __future__ import annotations

import ast
import json
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

GL = {"moderngl", "pyrender", "OpenGL", "glcontext"}
WEB = {"fastapi", "starlette", "uvicorn", "multipart", "python_multipart"}
OURS = {"farfield_core", "farfield_api", "farfield_worker", "farfield_shading", "farfield"}

#: package folder -> top-level modules that nothing in it may import
FORBIDDEN = {
    "services/core/farfield_core": (OURS - {"farfield_core", "farfield_shading"})
    | GL
    | WEB
    | {"numba", "trimesh"},
    "services/api/farfield_api": (OURS - {"farfield_core", "farfield_api"})
    | GL
    | {"numba", "trimesh"},
    "worker/farfield_worker": {"farfield_api", "farfield"} | WEB,
    "shading/farfield_shading": OURS - {"farfield_shading"} | GL | WEB,
}

#: lock and golden files are as long as they are
UNLIMITED = {"LICENSE", "requirements.lock", "web/package-lock.json"}
TEXT = {
    "", ".css", ".dockerignore", ".Dockerfile", ".glsl", ".html", ".js", ".json", ".lock", ".md",
    ".mjs", ".py", ".sh", ".toml", ".ts", ".tsx", ".yaml", ".yml",
}  # fmt: skip


def tracked() -> list[str]:
    """Paths of all files that are, or are about to be, in the repository."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    out = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return sorted(name for name in set(out.split("\0")) if name and (ROOT / name).is_file())


FILES = tracked()
TEXTS = [name for name in FILES if Path(name).suffix in TEXT]


def imports(source: str) -> set[str]:
    """Top-level names of every absolute import, wherever it stands in the source."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            names.add(node.module.split(".")[0])
    return names


def test_imports_are_found_wherever_they_stand() -> None:
    source = "import a.b\nfrom c.d import e\nfrom . import f\ndef g():\n    import h\n"
    assert imports(source) == {"a", "c", "h"}


@pytest.mark.parametrize("package", FORBIDDEN)
def test_arrows_point_one_way(package: str) -> None:
    files = [name for name in FILES if name.startswith(package + "/") and name.endswith(".py")]
    assert files
    wrong = {
        name: sorted(found)
        for name in files
        if (found := imports((ROOT / name).read_text(encoding="utf-8")) & FORBIDDEN[package])
    }
    assert wrong == {}


def test_the_viewers_core_knows_no_engine() -> None:
    core = "web/packages/core/src/"
    sources = [name for name in FILES if name.startswith(core) and name.endswith(".ts")]
    assert sources
    engine = re.compile(r"from '(three|@farfield/three|preact)")
    assert [n for n in sources if engine.search((ROOT / n).read_text(encoding="utf-8"))] == []


def matches(pattern: re.Pattern[str]) -> list[str]:
    """`file:line` of every line of a text file, this one aside, that the pattern finds."""
    here = Path(__file__).relative_to(ROOT).as_posix()
    return [
        f"{name}:{number}: {line.strip()[:120]}"
        for name in TEXTS
        if name != here
        for number, line in enumerate(
            (ROOT / name).read_text(encoding="utf-8").splitlines(), start=1
        )
        if pattern.search(line)
    ]


def test_no_file_names_a_registry() -> None:
    hosts = r"pypi\.org|pythonhosted|npmjs\.(org|com)|crates\.io|proxy\.golang|deb\.debian"
    assert matches(re.compile(hosts + r"|archive\.ubuntu|index-url\s*=|\"resolved\": \"http")) == []


def test_no_file_names_a_machine_path() -> None:
    # Paths inside images start with /home/farfield; everything else is somebody's machine.
    assert matches(re.compile(r"(?<![\w.])/(work|root|Users|home/(?!farfield\b)\w+)/")) == []


def test_nothing_is_left_to_do() -> None:
    assert matches(re.compile(r"\b(TO" r"DO|FIX" r"ME|XX" r"X|HACK)\b")) == []


def test_no_test_is_switched_off() -> None:
    found = matches(
        re.compile(r"@pytest\.mark\.(skip|xfail)\b|\b(it|test|describe)\.(skip|todo)\b")
    )
    assert found == []


def test_files_are_short() -> None:
    code = [n for n in TEXTS if Path(n).suffix in {".py", ".ts", ".tsx", ".js", ".mjs", ".glsl"}]
    lengths = {n: len((ROOT / n).read_text(encoding="utf-8").splitlines()) for n in code}
    assert {n: count for n, count in lengths.items() if count > 600} == {}


def test_web_lock_names_no_addresses() -> None:
    lock = ROOT / "web/package-lock.json"
    if not lock.exists():
        return
    packages = json.loads(lock.read_text(encoding="utf-8"))["packages"]
    outside = {k: v for k, v in packages.items() if "node_modules/" in k and not v.get("link")}
    assert [k for k, v in outside.items() if "resolved" in v] == []
    assert [k for k, v in outside.items() if "integrity" not in v] == []


def test_everything_in_the_lock_is_hashed() -> None:
    lines = (ROOT / "requirements.lock").read_text(encoding="utf-8").splitlines()
    pins = [i for i, line in enumerate(lines) if re.match(r"[\w.-]+(\[[\w,-]+\])?==", line)]
    assert len(pins) > 20
    assert [lines[i] for i in pins if "--hash=sha256:" not in lines[i + 1]] == []


def test_make_test_is_what_ci_runs() -> None:
    assert (ROOT / ".ci/run").read_text(encoding="utf-8").splitlines()[1:] == [
        'cd "$(dirname "$0")/.." && exec make test'
    ]
