"""Blocks that were reconstructed and written: what is said of them, and of several together."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from nearfar.transport.store import write_rows
from nearfar.workflow.blocks import Cut, Part, of_all


class Written(NamedTuple):
    """What is said of rows of a transport that were written.

    Attributes
    ----------
    lit, pixels : int
        Camera pixels that are lit directly, and all.
    provenance : mapping
        How they were made, and the worst of what each block tells.
    """

    lit: int = 0
    pixels: int = 0
    provenance: Mapping[str, Any] = {}

    def with_block(self, block: "Written") -> "Written":
        """Return what is said of these rows and one block more."""
        provenance = of_all(self.provenance, block.provenance)
        return Written(self.lit + block.lit, self.pixels + block.pixels, provenance)


def write_block(folder: Path, cut: Cut, block: slice, part: Part) -> Written:
    """Write a block into a folder that a transport is laid out in, or lay it out."""
    write_rows(folder, part.transport, block.start, rows=cut.rows, height=cut.height)
    lit = part.correspondence.lit
    return Written(int(lit.sum()), int(lit.size), dict(part.transport.provenance))
