"""Directives that run what a page shows, and show what came out: nothing stands there untried.

``{run}`` runs lines of bash in a folder that all directives of one page share, and shows them with
what they print. Options: ``status`` is the exit status that is expected, several apart by commas
(0); ``silent`` shows no output, ``hidden`` neither that nor the lines; ``pictures`` names files to
show below; ``needs`` names a program of the system without which the block is left out.

``{on-a-rig}`` shows lines that need a projector and a camera; tests/test_docs.py runs them, in
their order, on a virtual display before a virtual camera.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

# Seconds after which a block hangs, on the busiest machine too.
LONGEST_WAIT = 1800
# Lines of output that are shown at most.
LONGEST = 60


# What was started beside a block ends with it.
LEAVE = "trap 'beside=$(jobs -p); [ -z \"$beside\" ] || kill $beside' EXIT"


class Run(SphinxDirective):
    """Run lines of bash, and show them with what they print."""

    has_content = True
    option_spec: ClassVar = {
        "status": directives.unchanged,
        "silent": directives.flag,
        "hidden": directives.flag,
        "pictures": directives.unchanged,
        "needs": directives.unchanged,
    }

    def run(self) -> list[nodes.Node]:
        needed = self.options.get("needs")
        if needed and shutil.which(needed) is None:
            return []
        page = self.env.docname.replace("/", "-")
        folder = Path(self.env.app.outdir).parent / "run" / page
        folder.mkdir(parents=True, exist_ok=True)
        script = "\n".join(self.content)
        done = subprocess.run(
            ["bash", "-e", "-c", f"{LEAVE}\n{script}"],
            cwd=folder,
            env={
                **os.environ,
                "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
                "COLUMNS": "88",
                "NO_COLOR": "1",
            },
            capture_output=True,
            text=True,
            timeout=LONGEST_WAIT,
            check=False,
        )
        wanted = {int(status) for status in self.options.get("status", "0").split(",")}
        if done.returncode not in wanted:
            raise self.error(f"{script}\nended with {done.returncode}: {done.stderr}{done.stdout}")
        hidden = "hidden" in self.options
        found: list[nodes.Node] = [] if hidden else [_block(script, "console-input")]
        told = re.sub(r"[^\n]*\r", "", done.stdout + done.stderr).rstrip().replace(str(folder), ".")
        if told and not hidden and "silent" not in self.options:
            lines = told.splitlines()
            cut = [*lines[: LONGEST - 1], "..."] if len(lines) > LONGEST else lines
            found.append(_block("\n".join(cut), "console-output"))
        pictures = self.options.get("pictures", "").split()
        return found + [self._picture(folder / name, page) for name in pictures]

    def _picture(self, path: Path, page: str) -> nodes.Node:
        """Put a picture among the built pages' own."""
        kept = Path(self.env.app.outdir) / "_images" / f"{page}-{path.name}"
        kept.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, kept)
        up = "../" * self.env.docname.count("/")
        text = f'<img class="shown" alt="{path.stem}" src="{up}_images/{kept.name}">'
        return nodes.raw("", text, format="html")


class OnARig(SphinxDirective):
    """Show lines that a test runs on a rig."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        return [_block("\n".join(self.content), "console-input")]


def _block(text: str, kind: str) -> nodes.literal_block:
    block = nodes.literal_block(text, text, classes=[kind])
    block["language"] = "bash" if kind == "console-input" else "text"
    return block


def _begin(app: Sphinx) -> None:
    """Begin with empty folders, whatever an earlier build left."""
    shutil.rmtree(Path(app.outdir).parent / "run", ignore_errors=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """Tell Sphinx of the directives."""
    app.add_directive("run", Run)
    app.add_directive("on-a-rig", OnARig)
    app.connect("builder-inited", _begin)
    return {"parallel_read_safe": False}
