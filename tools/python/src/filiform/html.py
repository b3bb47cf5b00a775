"""What a notebook shows of a list of cells."""

from __future__ import annotations

import html
from typing import Sequence

from .cell import Cell


def cell_table(cells: Sequence[Cell]) -> str:
    most = 20
    rows = "".join(
        f"<tr><td>{cell.index}</td><td>{html.escape(cell.name.encode('utf-8', 'replace').decode())}</td>"
        f"<td>{cell.samples}</td><td>{cell.segments}</td></tr>"
        for cell in cells[:most]
    )
    more = f"<p>and {len(cells) - most} more</p>" if len(cells) > most else ""
    return (
        "<table><tr><th>index</th><th>name</th><th>samples</th><th>segments</th></tr>"
        f"{rows}</table>{more}"
    )
