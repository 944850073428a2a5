"""`farfield verify`: how good a walk is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from farfield.options import json_option, print_json
from farfield.progress import CellProgress

NAMES = ("wrong", "missing", "extra", "flip", "psnr", "pop")


@click.command("verify")
@click.argument("walk", type=click.Path(path_type=Path))
@click.option("--views", default=24, type=click.IntRange(1, 10000), help="views of each cell")
@click.option(
    "--pixels",
    type=click.IntRange(16, 4096),
    help="pixels across a view  [default: as many as a face has texels]",
)
@click.option(
    "--sheet", type=click.Path(path_type=Path, dir_okay=False), help="PNG of the worst views"
)
@json_option
def command(walk: Path, views: int, pixels: int | None, sheet: Path | None, as_json: bool) -> None:
    """Compare the walk in the folder WALK with full renders of its scene.

    Shares are of the pixels that show far field; "floor" is the full render against itself half
    a pixel off.
    """
    # GL and FLIP are not needed for other commands.
    from farfield_worker.verify.report import verify  # noqa: PLC0415
    from farfield_worker.verify.sheet import contact_sheet  # noqa: PLC0415

    progress: CellProgress | None = None

    def advance(_: int, total: int) -> None:
        nonlocal progress
        if progress is None:
            progress = CellProgress(total, 0, "verifying")
            progress.__enter__()
        progress.one_more()

    try:
        figures, worst = verify(walk, views, advance, pixels=pixels)
    finally:
        if progress is not None:
            progress.__exit__()
    if sheet is not None:
        contact_sheet(worst, sheet)
    if as_json:
        print_json(figures)
        return
    overall = figures["overall"]
    click.echo(f"{'':8} {'walk':>10} {'floor':>10} {'2x':>10} {'2x floor':>10}")
    for name in NAMES:
        columns = (overall, overall["floor"], overall["fine"], overall["fine"]["floor"])
        click.echo(f"{name:8} " + " ".join(_number(column[name]) for column in columns))


def _number(value: Any) -> str:
    return f"{value:10.3g}" if value is not None else f"{'-':>10}"
