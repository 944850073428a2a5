"""The contact sheet of `farfield verify`: the worst views, full render, walk and difference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from farfield_core.cells import cell_name
from PIL import Image, ImageDraw

from farfield_worker.verify.metrics import unmatched
from farfield_worker.verify.report import ComparedView

THUMB = 320
CAPTION = 18


def contact_sheet(views: list[ComparedView], out: Path) -> None:
    """Write a PNG with one row a view: full render, walk, and its wrong pixels in red."""
    sheet = Image.new("RGB", (3 * THUMB, max(1, len(views)) * (THUMB + CAPTION)), "white")
    draw = ImageDraw.Draw(sheet)
    for row, view in enumerate(views):
        top = row * (THUMB + CAPTION)
        gray = (view.full.mean(axis=2, keepdims=True) * 0.5 + 96).astype(np.uint8)
        wrong = np.repeat(gray, 3, axis=2)
        wrong[unmatched(view.full, view.walk)] = (220, 0, 0)
        for column, pixels in enumerate((view.full, view.walk, wrong)):
            thumb = Image.fromarray(pixels).resize((THUMB, THUMB), Image.Resampling.LANCZOS)
            sheet.paste(thumb, (column * THUMB, top + CAPTION))
        draw.text(
            (4, top + 3),
            f"cell {cell_name(view.cell)}, {view.pose.kind} eye"
            f" ({', '.join(f'{c:.2f}' for c in view.pose.eye)}),"
            f" yaw {view.pose.yaw:.3f}, pitch {view.pose.pitch:.3f}:"
            f" wrong {view.figures.wrong:.2e}, missing {view.figures.missing:.2e},"
            f" flip {view.figures.flip:.3f}",
            fill="black",
        )
    sheet.save(out, format="PNG")
