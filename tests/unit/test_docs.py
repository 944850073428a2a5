"""The documents keep their word: links lead somewhere, tables list what there is."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from farfield_api.app import PREFIX, create_app
from farfield_api.settings import VARIABLES, ApiSettings

ROOT = Path(__file__).parents[2]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def anchors(document: Path) -> set[str]:
    titles = re.findall(r"(?m)^#+ (.+)$", document.read_text(encoding="utf-8"))
    return {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_somewhere(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        # Pictures are written by the browser tests.
        if link.startswith(("http://", "https://", "docs/pictures/")):
            continue
        name, _, anchor = link.partition("#")
        target = document.parent / name if name else document
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


def test_every_direct_dependency_has_its_reason() -> None:
    text = (ROOT / "docs/architecture.md").read_text(encoding="utf-8").lower()
    missing = []
    places = ("pyproject.toml", "*/pyproject.toml", "services/*/pyproject.toml")
    for file in [file for place in places for file in ROOT.glob(place)]:
        project = tomllib.loads(file.read_text(encoding="utf-8"))
        wanted = project["project"].get("dependencies", [])
        wanted += project.get("dependency-groups", {}).get("dev", [])
        for dependency in wanted:
            name = re.split(r"[\[<>=;]", dependency)[0].lower()
            if not name.startswith("farfield") and name not in text:
                missing.append(name)
    assert missing == []


def test_every_setting_of_the_server_is_explained() -> None:
    text = (ROOT / "docs/deploy.md").read_text(encoding="utf-8")
    assert [name for name in VARIABLES.values() if f"`{name}`" not in text] == []


def test_every_route_is_explained(tmp_path: Path) -> None:
    schema = create_app(ApiSettings(store=str(tmp_path), web=tmp_path)).openapi()
    text = re.sub(r"[^a-z/]", " ", (ROOT / "docs/api.md").read_text(encoding="utf-8"))
    for path in schema["paths"]:
        last = path.removeprefix(PREFIX).replace(".json", "").split("{")[0].rstrip("/")
        words = [w for w in re.split(r"[/{}._]", path.removeprefix(PREFIX)) if w.isalpha()]
        assert all(word in text for word in words if word not in ("bake", "page")), (path, last)


def test_make_targets_named_in_the_readme_exist() -> None:
    targets = re.findall(r"(?m)^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"))
    named = re.findall(r"make ([a-z]+)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert named
    assert set(named) <= set(targets)
