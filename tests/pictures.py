"""Draws the picture of the README from its own worked example: ``python -m tests.pictures``."""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib as mpl

import rig
from tests.architecture.house import ROOT
from tests.pages import examples

PICTURE = ROOT / "rig" / "hold.png"


def draw(folder: Path) -> None:
    """Play the example in ``folder`` and draw its plain model over the recording."""
    for each in examples("yaml", page="README.md"):
        if each.page == "README.md" and each.file:
            (folder / each.file).write_text(each.text, encoding="utf-8")
    rig.run(folder / "hold.yaml", folder / "hold.h5")
    axes = rig.simulate(folder / "hold.h5").plot()
    axes[0].figure.savefig(PICTURE, dpi=80, pil_kwargs={"optimize": True})


if __name__ == "__main__":
    mpl.use("agg")
    with TemporaryDirectory() as made:
        draw(Path(made))
