"""Does text with a unit become the number meant, and is everything else refused with advice?"""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import MisfitError
from rig.units import exact, factor, multiple, quantity, show


@pytest.mark.parametrize(("text", "unit", "value"), [
    ("3 V", "V", 3.0), ("3V", "V", 3.0), ("-250 mV", "V", -0.25), ("10 µV", "V", 1e-5), ("200 ms", "s", 0.2),
    ("1 min", "s", 60.0), ("50 Hz", "Hz", 50.0), ("10 kHz", "Hz", 1e4), ("0.5 V/ms", "V/s", 500.0),
    ("90 deg", "rad", math.pi / 2), ("0.1 %", "", 1e-3), ("5 ppm", "", 5e-6), ("8 V/V", "V/V", 8.0),
    ("2 1/s", "1/s", 2.0),
    ("0.01 rad/s", "Hz", 0.01 / (2 * math.pi)), ("1 Hz", "rad/s", 2 * math.pi), ("1e-4 s", "s", 1e-4),
    ("8", "V/V", 8.0),
])
def test_units_are_converted(text: str, unit: str, value: float) -> None:
    assert quantity(text, unit) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize("bare", [3, 3.5, "3"])
def test_a_bare_number_is_refused_where_a_unit_belongs(bare: object) -> None:
    with pytest.raises(MisfitError, match=r"a number without a unit: 3.*allowed: a voltage; write '3.* V'"):
        quantity(bare, "V")


@pytest.mark.parametrize(("text", "value"), [("100 us", 1e-4), ("0.1 %", 1e-3), ("3 ms", 3e-3), ("30 mV", 0.03)])
def test_decimal_text_becomes_the_nearest_float(text: str, value: float) -> None:
    assert quantity(text, "s" if "s" in text else "V" if "V" in text else "") == value


def test_a_bare_number_is_taken_where_no_unit_belongs() -> None:
    assert quantity(8, "V/V") == 8.0


@pytest.mark.parametrize(("text", "unit", "message"), [
    ("3 Volt5", "V", "unknown unit 'Volt5'|not a voltage"),
    ("3 hz", "Hz", "did you mean 'Hz'"),
    ("3 s", "V", r"wrong unit 's'; allowed: a voltage, as in '3 V'"),
    ("3 V", "s", r"wrong unit 'V'; allowed: a time, as in '200 ms'"),
    ("three volts", "V", "not a voltage with a unit"),
    ("3 dBm", "V", "wrong unit 'dBm'"),
    ("1e999 V", "V", "not a finite number"),
    ("nan V", "V", "not a voltage with a unit"),
    ("__import__('os') V", "V", "not a voltage with a unit"),
    (True, "V", "a voltage is needed"),
    (None, "V", "a voltage is needed"),
    ([3], "V", "a voltage is needed"),
])
def test_anything_else_is_refused(text: object, unit: str, message: str) -> None:
    with pytest.raises(MisfitError, match=message):
        quantity(text, unit)


def test_an_offset_unit_is_no_factor() -> None:
    with pytest.raises(MisfitError, match="logarithmic or offset"):
        factor("degC", "K")


def test_a_multiple_counts_a_quantity() -> None:
    assert multiple("640 x 0.01 rad/s", "Hz") == pytest.approx(6.4 / (2 * math.pi), rel=1e-14)
    assert multiple("10 kHz", "Hz") == 1e4


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(["V", "s", "Hz", "V/s", ""]))
def test_exact_text_reads_back_to_the_last_bit(value: float, unit: str) -> None:
    assert quantity(exact(value, unit), unit) == value


def test_messages_show_six_digits() -> None:
    assert show(1 / 3, "V") == "0.333333 V"
    assert show(2.0, "") == "2"
