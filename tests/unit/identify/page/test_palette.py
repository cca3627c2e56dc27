"""Do pictures survive a grey printer and the colour-blind: do colours differ in lightness, and not in colour alone?

Contrast is that of WCAG 2.1: 4.5 to 1 for words (criterion 1.4.3), 3 to 1 for what a picture draws (1.4.11). How
those see who lack one kind of cone: Machado, Oliveira, Fernandes, IEEE Trans. Vis. Comput. Graph. 15 (2009) 1291.
Distances are CIE 1976, in which 2.3 is just noticed; what is told apart at a glance is ten times as far apart.
"""

import base64
import re

import numpy as np
import pytest

from identify.page.drawing import AFTER, BEFORE, EDGE, INK, RECORDED, Look
from identify.page.report import explanation_page
from identify.page.rig_pictures import BRANCHES
from tests.unit.identify.page.test_report import Page, explanation, identification

PAPER = "#ffffff"
AT_A_GLANCE = 23.0
WORDS, DRAWN = 4.5, 3.0
TO_XYZ = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
                   [0.0193339, 0.1191920, 0.9503041]])  # fmt: skip
SIGHTS = {
    "every cone": np.eye(3),
    "no L cones": np.array([[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                            [-0.003882, -0.048116, 1.051998]]),
    "no M cones": np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                            [-0.011820, 0.042940, 0.968881]]),
    "no S cones": np.array([[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
                            [0.004733, 0.691367, 0.303900]]),
    "grey printer": np.tile(TO_XYZ[1], (3, 1)),
}  # fmt: skip
def linear(colour: str) -> np.ndarray:
    """Return red, green and blue as light, 0 to 1."""
    v = np.array([int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)])
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def contrast(one: str, other: str) -> float:
    dark, light = sorted(float(TO_XYZ[1] @ linear(colour)) for colour in (one, other))
    return (light + 0.05) / (dark + 0.05)


def lab(light: np.ndarray) -> np.ndarray:
    ratio = TO_XYZ @ np.clip(light, 0.0, 1.0) / TO_XYZ.sum(axis=1)
    x, y, z = np.where(ratio > 216.0 / 24389.0, np.cbrt(ratio), (24389.0 / 27.0 * ratio + 16.0) / 116.0)
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


def apart(one: str, other: str, sight: str) -> float:
    return float(np.linalg.norm(lab(SIGHTS[sight] @ linear(one)) - lab(SIGHTS[sight] @ linear(other))))


@pytest.mark.parametrize("sight", SIGHTS)
def test_the_models_are_told_apart_by_everybody(sight: str) -> None:
    assert apart(BEFORE.colour, AFTER.colour, sight) > AT_A_GLANCE


@pytest.mark.parametrize("sight", sorted(SIGHTS.keys() - {"grey printer"}))
def test_the_recording_is_told_from_the_models(sight: str) -> None:
    """In grey its breadth tells it, four times that of a model's line."""
    assert min(apart(RECORDED, look.colour, sight) for look in (BEFORE, AFTER)) > AT_A_GLANCE


def test_nothing_is_told_apart_by_its_colour_alone() -> None:
    assert BEFORE.line != AFTER.line
    assert BEFORE.marker != AFTER.marker
    assert BEFORE.filling != AFTER.filling
    assert len({look.marker for look in BRANCHES.values()}) == len(BRANCHES)
    assert BRANCHES["loading"].line != BRANCHES["unloading"].line


@pytest.mark.parametrize("look", [BEFORE, AFTER, Look(INK), Look(EDGE), Look(RECORDED), *BRANCHES.values()])
def test_what_is_drawn_stands_out_from_the_paper(look: Look) -> None:
    assert contrast(look.colour, PAPER) >= DRAWN


def test_every_word_in_a_picture_stands_out_from_the_paper() -> None:
    colours = set()
    for image in Page(explanation_page(explanation(), identification()).html()).images:
        kind, _, held = str(image["src"]).partition(";base64,")
        if "svg" in kind:
            texts = re.findall(r"<text[^>]*>", base64.b64decode(held).decode())
            assert texts
            colours |= {(re.search(r"fill: (#[0-9a-f]{6})", text) or ["", "#000000"])[1] for text in texts}
    assert INK in colours
    assert min(contrast(colour, PAPER) for colour in colours) >= WORDS


def test_these_measures_know_good_from_bad() -> None:
    assert contrast("#000000", PAPER) == pytest.approx(21.0)
    assert contrast("#777777", PAPER) == pytest.approx(4.48, abs=0.01)
    assert apart("#ff0000", "#00ff00", "every cone") == pytest.approx(170.6, abs=0.1)
    assert apart("#d7191c", "#1a9641", "every cone") > 3.0 * apart("#d7191c", "#1a9641", "no M cones")
    assert apart("#d51e00", "#006fd5", "grey printer") < AT_A_GLANCE
