"""Does a simulated rig give every input what it would read, at the instant it is read?"""

from dataclasses import replace

import numpy as np
import pytest

from drivers.emulators.bench import WIRED, Bench
from rig.capabilities import Capabilities
from rig.rigfile import parse_rig
from tests.rigs import GAIN, QUIET

CAN = Capabilities(output_low_v=-10.0, output_high_v=10.0, input_low_v=-40.0, input_high_v=40.0, min_rate_hz=1.0,
                   max_rate_hz=1e6, output_bits=16, input_bits=32, inputs=4)


def played(rig: str, u: np.ndarray, rate_hz: float, inputs: int, multiplexed: bool) -> dict[str, np.ndarray]:
    bench = Bench(parse_rig(rig, "test"), replace(CAN, multiplexed=multiplexed))
    bench.reset(rate_hz, 0, inputs)
    codes = bench.play(bench.dac.codes(u))
    return dict(zip(WIRED, bench.adc.volts(codes).T, strict=False))


@pytest.mark.parametrize("multiplexed", [False, True])
def test_the_first_input_is_read_before_the_output_acts(multiplexed: bool) -> None:
    u = np.array([1.0, -2.0, 3.0])
    assert played(GAIN, u, 1e3, 4, multiplexed)["y"] == pytest.approx([0.0, 3.0, -6.0], abs=2e-3)


def test_inputs_read_together_see_what_was_before() -> None:
    u = np.array([1.0, -2.0, 3.0])
    read = played(GAIN, u, 1e3, 4, multiplexed=False)
    for name in ("u_measured", "v"):
        assert read[name] == pytest.approx([0.0, 1.0, -2.0], abs=2e-3)


@pytest.mark.parametrize("inputs", [2, 3, 4])
def test_a_multiplexer_reads_each_input_a_share_of_a_sample_later(inputs: int) -> None:
    """The truth is the same rig with a clock as many times faster, each level held as many ticks."""
    u, rate_hz = 8.0 * np.sin(np.arange(300) * 0.1), 1000.0
    skewed = played(QUIET, u, rate_hz, inputs, multiplexed=True)
    fine = played(QUIET, np.repeat(u, inputs), inputs * rate_hz, inputs, multiplexed=False)
    for place, (name, values) in enumerate(skewed.items()):
        assert values == pytest.approx(fine[name][place::inputs], abs=2e-3), name
    assert np.abs(skewed["u_measured"] - fine["u_measured"][::inputs]).max() > 0.1, "the skew makes no difference"


def test_skews_are_told_in_sample_periods() -> None:
    assert CAN.skews(4) == (0.0, 0.0, 0.0, 0.0)
    assert replace(CAN, multiplexed=True).skews(4) == (0.0, 0.25, 0.5, 0.75)
    assert replace(CAN, multiplexed=True).skews(1) == (0.0,)
