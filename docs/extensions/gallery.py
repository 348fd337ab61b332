"""The order of the gallery: from a first transport to what it is used for."""

from pathlib import Path

ORDER = (
    "first_transport",
    "row",
    "fewer_photos",
    "paper_and_joint",
    "correspondence",
    "error_bars",
    "verdict",
    "physical_split",
    "probing",
    "bounces",
    "dual_view",
    "compensation",
    "singular_values",
    "own_transport",
)


class ReadingOrder:
    """Sort key of Sphinx-Gallery: the place of an example in `ORDER`."""

    def __init__(self, src_dir: str) -> None:
        self.src_dir = src_dir

    def __call__(self, filename: str) -> int:
        """Return the place of an example.

        Raises
        ------
        ValueError
            If it has none.
        """
        return ORDER.index(Path(filename).stem.removeprefix("plot_"))

    def __repr__(self) -> str:
        return "<reading order>"
