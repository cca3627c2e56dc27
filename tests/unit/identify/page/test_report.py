"""Do the report pages say the verdict first, show their pictures, and need nothing from outside?"""

import base64
import re
import tomllib
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import identify
from identify.chain import Chain, plain_chain, simulate
from identify.effects.hum import Hum
from identify.effects.saturation import Saturation
from identify.explain.explanation import (
    Alternative,
    Explanation,
    Finding,
    HeldOut,
    Location,
    Profile,
    Range,
    Remaining,
    Residuals,
)
from identify.explain.rig_file import HeldToRigFile, Moved
from identify.explain.shape import Shape
from identify.explain.survey import StageShare
from identify.fit import Fit
from identify.identification import FrequencyPoint, Identification, StairPoint, Unidentifiable
from identify.interval import Interval
from identify.model import Backlash, LinearF, Model, Physics, Rational
from identify.natural_units import shown, shown_interval
from identify.noise import Noise
from identify.observe import Observation, joined, rms
from identify.page import answers, place_pictures
from identify.page.document import Imprint
from identify.page.drawing import embedded
from identify.page.report import at_first_glance, explanation_page, identification_page
from identify.page.rig_pictures import border
from identify.page.thinned import envelope, longest_stretch, outline
from identify.stage import Place
from identify.trace import Trace
from tests.trials import shelved

MODEL = Model(
    "op-amp backlash circuit",
    Rational((1000.0,), (1e-4, 20.0, 1000.0)),
    Backlash(8.0, 1.25, 8.0, -1.25),
    Rational((1000.0,), (1e-6, 2.0, 1000.0)),
    noise_v=0.01,
)
RAILS = Saturation(Place.F, "both")
VOID = {"br", "img", "meta", "link", "hr", "input"}


class Page(HTMLParser):
    """What a browser would see: balanced tags, images, headings, text, references."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.images: list[dict[str, str | None]] = []
        self.references: list[str] = []
        self.words: dict[str, list[str]] = {}
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)
        if tag == "img":
            self.images.append(dict(attrs))
        self.references += [value or "" for name, value in attrs if name in ("src", "href", "action", "data")]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if data.strip():
            for tag in self.open:
                self.words.setdefault(tag, []).append(data.strip())

    def text(self, tag: str) -> str:
        return " ".join(self.words.get(tag, []))


def trace(name: str, u: np.ndarray, chain: Chain) -> Trace:
    blank = Trace(name, 10_000.0, u, np.zeros(u.size))
    noise = 0.01 * np.random.default_rng(len(name)).standard_normal(u.size)
    return Trace(name, 10_000.0, u, simulate(chain, blank, 2) + noise)


def railed() -> Chain:
    return RAILS.put_in(plain_chain(MODEL), {"upper": 10.0, "lower": -10.0})


def observations() -> tuple[Observation, Observation]:
    levels = np.concatenate((np.arange(0, -3.1, -0.5), np.arange(-2.5, 3.1, 0.5), np.arange(2.5, -3.6, -0.5)))
    staircase = trace("staircase", np.repeat(levels, 1000), railed())
    sine = trace("sine", 10.0 * np.sin(2 * np.pi * 50.0 * np.arange(20_000) / 10_000.0), railed())
    return tuple(Observation(t, np.ones(t.size, dtype=bool), 0.01, 2) for t in (staircase, sine))


def fitted(chain: Chain) -> Fit:
    return Fit(chain, (), np.zeros(0), 0.0, np.zeros((0, 0)), True, "converged")


def around(value: float, half: float) -> Interval:
    return Interval(value, value - half, value + half)


def identification(**changes: object) -> Identification:
    borders = {
        "S_L": around(8.0012, 0.002),
        "D_L": around(1.2503, 0.0006),
        "S_U": around(7.9991, 0.002),
        "D_U": around(-1.2496, 0.0006),
    }
    stairs = tuple(
        StairPoint("staircase", level, around(border(MODEL, branch, np.array([level]))[0] + 0.004, 0.01), branch)
        for level, branch in ((-2.0, "unloading"), (-1.0, "plateau"), (2.0, "loading"), (3.0, "saturated"))
    )
    point = FrequencyPoint(50.0, around(0.1572, 0.0003), around(-1.31, 0.002))
    found = Identification(
        MODEL,
        fitted(plain_chain(MODEL)),
        observations(),
        Noise(0.01, "repeated periods"),
        0.0101,
        99.87,
        borders,
        borders,
        (point,),
        (point,),
        stairs,
        (Unidentifiable("delay shared between G1 and G2", "it moves freely", "G1 has none"),),
        ("50 Hz: the gap is stuck at U = 3 V, raise it above 7.95 V",),
    )
    return replace(found, **changes)


def explanation(**changes: object) -> Explanation:
    edges = np.linspace(-18.0, 18.0, 13)
    finding = Finding(
        "saturation",
        "F",
        "both",
        0.984,
        {"upper": (around(9.9803, 0.0013), "V"), "lower": (around(-9.9811, 0.0012), "V")},
        "w' = min(max(w, lower), upper)",
        "An amplifier in F runs into its supply rails.",
        (Alternative("adc_clipping", "sense", 0.016),),
        "a faster sine of the same amplitude",
    )
    train = observations()[:1]
    told = Explanation(
        "explained",
        "The rails at ±9.98 V were left out; with them the recording is explained.",
        Noise(0.0101, "repeated periods"),
        0.21,
        0.0,
        Location("F", (Range("level of w", 9.9, 18.0, "V", 0.97),), "The mismatch enters in F.", ("sense",)),
        (finding,),
        Residuals(0.2112, 0.01022),
        HeldOut(("sine",), "a run of its own", Residuals(0.2034, 0.01013), 0.01013),
        Remaining(1.01, None, "Nothing beyond the noise."),
        MODEL,
        fitted(plain_chain(MODEL)),
        fitted(railed()),
        train,
        observations()[1:],
        (Profile("level of w", "V", edges, np.full(12, 0.2), np.full(12, 0.01)),),
        (
            StageShare("F", "level of w", "a memoryless law", 0.97, 0.0),
            StageShare("sense", "level of y", "a memoryless law", 0.93, 0.0),
        ),
        ("look here <now>",),
        HeldToRigFile(0.4, ()),
    )
    return replace(told, **changes)


def drawings(page: Page) -> list[ElementTree.Element]:
    """Return the embedded SVG pictures, each parsed as the XML it must be; all others must be PNG."""
    found = []
    for image in page.images:
        kind, _, held = str(image["src"]).partition(";base64,")
        data = base64.b64decode(held)
        if kind == "data:image/svg+xml":
            found.append(ElementTree.fromstring(data))
        else:
            assert kind == "data:image/png"
            assert data.startswith(b"\x89PNG")
    return found


@pytest.fixture(scope="module")
def explained() -> str:
    imprint = Imprint("spec: 1\nrig: a <b>\n", {"rig": "0.1.0"}, (("sine", "stopped by <Ctrl-C>"),))
    return explanation_page(explanation(), identification(), imprint).html()


def test_the_page_opens_with_the_verdict(explained: str) -> None:
    page = Page(explained)
    assert page.open == []
    assert page.text("h1") == "The rails at ±9.98 V were left out; with them the recording is explained."
    assert explained.index("<h1>") < explained.index("<section")


def test_the_page_tells_place_physics_doubt_proof_and_model(explained: str) -> None:
    words = Page(explained).text("main")
    for expected in (
        "The mismatch enters in F.",
        "97 %",
        "9.9803 V ± 1.3 mV",
        "-9.9811 V ± 1.2 mV",
        "w' = min(max(w, lower), upper)",
        "98 %",
        "adc clipping in sense",
        "What would tell them apart: a faster sine",
        "To tell saturation from adc clipping",
        "1.01 times the noise",
        "a faster sine of the same amplitude",
        "203.4 mV",
        "10.13 mV",
        "Nothing beyond the noise.",
        "look here <now>",
        "rig: a <b>",
        "rig 0.1.0",
    ):
        assert expected in words


def test_the_signal_path_marks_the_place_and_what_cannot_be_excluded(explained: str) -> None:
    marks = re.findall(r'<li(?: class="(\w+)")?(?: aria-current="true")?><b>(\w+)</b>', explained)
    assert marks == [("", "source"), ("", "G1"), ("here", "F"), ("", "G2"), ("maybe", "sense")]
    assert "What was left out: saturation (supply rails)" in Page(explained).text("h2")


def test_every_picture_is_inside_the_page_and_told_in_words(explained: str) -> None:
    page = Page(explained)
    assert len(page.images) == 2 + 1 + 1 + 2 + 2 + 2 + 2 + 1 + 4
    assert len(drawings(page)) == len(page.images) - 2
    titles = page.text("h2") + page.text("h3")
    for title in ("At a glance", "Which stage could explain it", "On data kept back", "Where the mismatch sits",
                  "On the data fitted", "Staircase and borders", "Backlash loop", "Spectrum of the residual",
                  "Frequency response"):  # fmt: skip
        assert title in titles


def test_the_words_of_a_picture_say_what_is_to_be_seen(explained: str) -> None:
    """Every alternative text has numbers with units in it, the very ones that are drawn, and no two are alike."""
    words = [str(image["alt"]) for image in Page(explained).images]
    assert len(set(words)) == len(words)
    assert all(re.search(r"\d (?:[mµ]?V|Hz|%|degrees|settled|frequencies)", text) for text in words)
    plain, improved = (observations()[1].residual(chain) for chain in (plain_chain(MODEL), railed()))
    over_all = next(text for text in words if text.startswith("Recorded y minus model over all of sine: the plain"))
    for residual in (plain, improved):
        assert f"{shown(rms(residual), 'V', 3)} rms and at most {shown(np.max(np.abs(residual)), 'V', 3)}" in over_all
    (stages,) = [text for text in words if text.startswith("Share of the mismatch")]
    assert "F 97 % (a memoryless law of level of w), sense 93 %" in stages


def test_a_recording_that_is_incomplete_is_said_to_be_at_the_top(explained: str) -> None:
    assert explained.index("Incomplete:") < explained.index("<section")
    assert "sine: stopped by &lt;Ctrl-C&gt;" in explained


def test_the_page_refers_to_nothing_outside(explained: str) -> None:
    page = Page(explained)
    assert all(reference.startswith("data:") for reference in page.references)
    assert not re.search(r"@import|url\(|<script|<link", explained)
    for drawing in drawings(page):
        for element in drawing.iter():
            for name, value in element.attrib.items():
                assert not (name.endswith("href") and not value.startswith("#"))


def test_the_residual_picture_shows_both_models(explained: str) -> None:
    pictures = ["".join(drawing.itertext()) for drawing in drawings(Page(explained))]
    assert any("plain, " in text and "improved, 10 mV rms" in text for text in pictures)


def test_what_is_undecided_stands_beside_the_verdict(explained: str) -> None:
    assert "Not decided" not in explained
    (finding,) = explanation().effects
    even = replace(finding, probability=0.5, could_also_be=(Alternative("adc_clipping", "sense", 0.5),))
    text = explanation_page(explanation(effects=(even,))).html_with(lambda panel: "")
    header = text[text.index("<header") : text.index("</header>")]
    assert "saturation at F (50 %) or adc clipping at sense (50 %)" in header
    assert "Where it differs: F or sense" in Page(text).text("h2")


def test_a_run_held_out_is_drawn_with_the_phase_the_proof_gave_it() -> None:
    """A phase of the mains is a run's own: one that no fit has seen is fitted before the run is drawn."""
    hum = {"frequency": 50.0, "amplitude": 0.2, "third": 0.0, "fifth": 0.0, "third_phase": 0.0, "fifth_phase": 0.0}
    bench = Hum(Place.SENSE, "").put_in(railed(), {**hum, "phase": 2.0})
    model = Hum(Place.SENSE, "").put_in(railed(), {**hum, "phase": 0.0})
    u = 10.0 * np.sin(2 * np.pi * 31.0 * np.arange(20_000) / 10_000.0)
    unseen = Observation(trace("unseen", u, bench), np.ones(u.size, dtype=bool), 0.01, 2)
    told = explanation(improved=fitted(model), test=(unseen,), train=observations()[:1])
    words = [panel.alt for picture in at_first_glance(told) for panel in picture.panels]
    (left,) = re.findall(r"([0-9.]+) mV rms for the improved model", words[1])
    assert float(left) < 11.0


def test_values_that_the_recordings_say_are_others_stand_beside_those_of_the_rig_file() -> None:
    moved = Moved("D_L", "V", 1.4, Interval(1.2501, 1.2499, 1.2503))
    page = Page(explanation_page(explanation(rig_file=HeldToRigFile(0.4, (moved,)))).html_with(lambda panel: ""))
    assert "What the rig file has otherwise" in page.text("h2")
    assert "differs from the fitted runs by 400 mV rms" in page.text("main")
    for cell in ("D_L", "1.4 V", "1.25010 V ± 200 µV"):
        assert cell in page.text("td")
    as_it_is = Page(explanation_page(explanation()).html_with(lambda panel: ""))
    assert "What the rig file has otherwise" not in as_it_is.text("h2")


def test_physics_without_a_name_shows_its_shape_and_what_to_do_next() -> None:
    at = np.linspace(-18.0, 18.0, 9)
    drawn = Shape("level of w", "V", "added", "V", at, ("",), (0.02 * np.sin(at),), (np.full(9, 0.001),))
    unnamed = Finding("unnamed", "F", "map of the level", 1.0, {}, "s' = s + c(s)", "A law at F.", (), None, drawn)
    told = explanation(
        verdict="unexplained", effects=(unnamed,), remaining=Remaining(20.0, "F", "It is located above."),
        held_out=HeldOut(("sine",), "a run of its own", Residuals(0.2034, 0.01013), 0.2034),
    )  # fmt: skip
    page = Page(explanation_page(told).html_with(lambda panel: ""))
    assert "What it looks like" in page.text("h3")
    assert "staircase of fine steps" in page.text("main")
    assert "probes on v and w" in page.text("main")
    assert "To tell where it enters" not in page.text("main")
    asked = replace(told, effects=(replace(unnamed, would_separate="separate_unnamed_F.yaml: 2 s of it"),))
    words = Page(explanation_page(asked).html_with(lambda panel: "")).text("main")
    assert "To tell where it enters: separate_unnamed_F.yaml: 2 s of it." in words
    sure = replace(explanation().effects[0], could_also_be=())
    named = Page(explanation_page(explanation(effects=(sure,))).html_with(lambda panel: ""))
    assert "To tell where it enters" not in named.text("main")
    assert "Nothing else in the catalogue" not in page.text("main")
    (panel,) = place_pictures.shape(unnamed).panels
    assert "from -19.6 mV at 4.5 V to 19.6 mV at -4.5 V" in panel.alt
    assert embedded(panel).startswith("data:image/svg")
    shape = told.to_dict()["effects"][0]["shape"]
    assert (shape["axis"], len(shape["curves"][0]["value"])) == ("level of w", 9)


def test_the_page_names_what_named_physics_alone_leaves() -> None:
    held = HeldOut(("sine",), "a run of its own", Residuals(0.2034, 0.01013), 0.05)
    page = explanation_page(explanation(verdict="partly_explained", held_out=held))
    words = Page(page.html_with(lambda panel: "")).text("main")
    assert "held out, named physics alone" in words
    assert "50 mV" in words


def test_nothing_missing_is_told_without_effects() -> None:
    text = explanation_page(
        explanation(verdict="consistent", sentence="Nothing is missing.", location=None, effects=(), profiles=())
    ).html()
    page = Page(text)
    assert page.text("h1") == "Nothing is missing."
    assert 'id="location"' not in text
    assert "improved, " not in "".join("".join(d.itertext()) for d in drawings(page))


def test_the_identification_page_has_the_numbers_and_what_cannot_be_told() -> None:
    page = Page(identification_page(identification()).html())
    words = page.text("main")
    assert "nothing beyond the noise is left" in page.text("h1")
    for expected in ("8.0012 ± 0.002", "1.25030 V ± 600 µV", "0.15720 ± 0.0003", "it moves freely",
                     "raise it above 7.95 V", "99.87 %"):  # fmt: skip
        assert expected in words
    assert len(page.images) == 2 + 2 + 1 + 4 + 2 + 1


def test_a_poor_fit_and_a_failed_one_are_said_first() -> None:
    assert "20 times the noise" in identification_page(identification(rms_v=0.2)).content["headline"]
    failed = replace(fitted(plain_chain(MODEL)), converged=False, sentence="no minimum within 30 iterations")
    assert "did not settle (no minimum within 30" in identification_page(identification(fit=failed)).content["headline"]


def test_a_rig_without_backlash_or_staircase_has_its_page_too() -> None:
    model = replace(MODEL, f=LinearF(0.93, 0.002), physics=(Physics("dead_time", {"delay": 1e-3}, "G2"),))
    page = Page(
        identification_page(
            identification(
                model=model, fit=fitted(plain_chain(model)), borders={}, own_scale={}, staircase=(), g1=(), g2=()
            )
        ).html()
    )
    assert "w = 0.93 v + 2 mV" in page.text("main")
    assert "dead time" in page.text("table")
    assert "delay 1 ms" in page.text("table")
    assert len(page.images) == 2 + 1 + 2 + 1


def test_a_long_run_makes_a_small_page() -> None:
    u = 3.0 * np.sin(2 * np.pi * 5.0 * np.arange(400_000) / 10_000.0)
    one = Observation(trace("long", u, railed()), np.ones(u.size, dtype=bool), 0.01)
    text = explanation_page(explanation(train=(one,), test=())).html()
    assert len(text) < 1_500_000


@pytest.mark.parametrize("counts_from", [0, 30_000])
def test_of_a_very_long_run_the_beginning_is_drawn(monkeypatch: pytest.MonkeyPatch, counts_from: int) -> None:
    monkeypatch.setattr(answers, "DRAWN", 20_000)
    u = 3.0 * np.sin(2 * np.pi * 5.0 * np.arange(50_000) / 10_000.0)
    use = np.arange(u.size) >= counts_from
    one = Observation(shelved(trace("long", u, railed())), use, 0.01)
    assert "drawn up to sample 20000" in explanation_page(explanation(train=(one,), test=())).html()


def test_parts_of_one_run_are_drawn_as_one_run() -> None:
    whole, other = observations()
    early = replace(whole, use=np.arange(whole.trace.size) < 100)
    late = replace(whole, use=np.arange(whole.trace.size) >= 300)
    drawn = joined((early, other, late))
    assert [o.trace.name for o in drawn] == ["staircase", "sine"]
    assert drawn[0].count == whole.trace.size - 200


def test_the_envelope_keeps_every_extreme() -> None:
    values = np.random.default_rng(1).standard_normal(100_000)
    values[77_777], values[5:50] = 40.0, np.nan
    index, low, high = envelope(values, 300)
    assert index.size == 300
    assert high.max() == 40.0
    assert low.min() == np.nanmin(values)


def test_the_outline_of_many_periods_is_as_small_as_that_of_one() -> None:
    turn = 2 * np.pi * np.arange(2_000) / 2_000
    once = outline(np.cos(turn), np.sin(turn))[0].size
    often = outline(np.tile(np.cos(turn), 50), np.tile(np.sin(turn), 50))[0].size
    assert once <= often <= once + 3


def test_the_outline_keeps_place_and_size() -> None:
    turn = 2 * np.pi * np.arange(2_001) / 2_000
    x, y = outline(3.0 + np.cos(turn), 5.0 * np.sin(turn))
    assert np.nanmin(x) == pytest.approx(2.0, abs=1e-9)
    assert np.nanmax(y) == pytest.approx(5.0, abs=1e-9)
    radius = np.hypot(x - 3.0, y / 5.0)
    assert np.nanmax(np.abs(radius - 1.0)) < 2e-3
    assert np.isnan(x).sum() == x.size // 3


def test_the_longest_stretch_is_found() -> None:
    assert longest_stretch(np.array([True, False, True, True, False])) == slice(2, 4)
    assert longest_stretch(np.zeros(3, dtype=bool)) == slice(0, 0)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (4.2e-6, "s", "4.2 µs"),
        (0.0101, "V", "10.1 mV"),
        (1.0, "V", "1 V"),
        (-9.98, "V", "-9.98 V"),
        (0.0, "V", "0 V"),
        (51_200.0, "Hz", "51.2 kHz"),
        (6e-4, "V", "600 µV"),
        (0.93, "V/V", "0.93"),
        (1.5e-9, "s^2", "1.5e-09 s^2"),
        (float("inf"), "V", "none"),
    ],
)
def test_numbers_are_shown_in_natural_units(value: float, unit: str, text: str) -> None:
    assert shown(value, unit) == text


@pytest.mark.parametrize(
    ("interval", "unit", "text"),
    [
        (Interval(9.98, 9.9787, 9.9813), "V", "9.9800 V ± 1.3 mV"),
        (Interval(1.04e-3, 1.02e-3, 1.06e-3), "s", "1.040 ms ± 20 µs"),
        (Interval(1.0, 0.5, 3.0), "V", "1.0 V (500 mV to 3 V)"),
        (Interval(2.0, 2.0, 2.0), "V", "2 V (held fixed)"),
        (Interval(2.0, float("-inf"), float("inf")), "V", "2 V (interval not bounded)"),
    ],
)
def test_intervals_are_shown_in_natural_units(interval: Interval, unit: str, text: str) -> None:
    assert shown_interval(interval, unit) == text


def test_the_templates_are_installed_with_the_package() -> None:
    root = Path(identify.__file__).parents[1]
    declared = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]
    page = root / "identify" / "page"
    installed = {path for pattern in declared.get("identify.page", []) for path in page.glob(pattern)}
    assert installed >= set((page / "templates").iterdir())
