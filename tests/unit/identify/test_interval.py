"""Are numbers told with their units and their doubt, and never more of either than there is?"""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.interval import Interval, number
from identify.natural_units import prefix_of, shown, shown_interval


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (4.2e-6, "s", "4.2 µs"), (0.0, "V", "0 V"), (-9.98034, "V", "-9.98 V"), (1234.5, "Hz", "1.234 kHz"),
        (0.0137, "V/V", "0.0137"), (0.077, "1/s", "0.077 1/s"), (2.3e-4, "s", "230 µs"), (0.9999999, "V", "1 V"),
        (math.inf, "V", "none"), (math.nan, "V", "not known"), (1e-15, "V", "0.001 pV"), (3.0, "", "3"),
    ],
)  # fmt: skip
def test_a_value_is_shown_in_the_unit_an_operator_would_use(value, unit, text):
    assert shown(value, unit) == text


@pytest.mark.parametrize(
    ("interval", "text"),
    [
        (Interval(9.9803, 9.979, 9.9816), "9.9803 V ± 1.3 mV"),
        (Interval(1.25, 1.25, 1.25), "1.25 V (held fixed)"),
        (Interval(1.25, 0.4, math.inf), "1.25 V (at least 400 mV)"),
        (Interval(1.25, 0.0, math.inf), "1.25 V (interval not bounded)"),
        (Interval(1.25, -math.inf, math.inf), "1.25 V (interval not bounded)"),
        (Interval(10.0, 9.0, 13.0), "10.0 V (9 V to 13 V)"),
    ],
)
def test_an_interval_is_shown_with_as_many_digits_as_it_bears(interval, text):
    assert shown_interval(interval, "V") == text


@given(st.floats(1e-11, 1e11), st.sampled_from(["V", "s", "Hz"]))
def test_a_prefix_leaves_a_number_easy_to_say(value, unit):
    factor, prefix = prefix_of(value, unit)
    assert 0.999 <= value / factor < 1000.001
    assert (factor == 1.0) == (prefix == "")


@given(st.floats(allow_nan=True, allow_infinity=True))
def test_json_has_no_infinity(value):
    told = number(value)
    assert told is None or told == pytest.approx(value, rel=1e-5)
    json.dumps(told, allow_nan=False)


def test_answers_carry_value_unit_and_interval():
    assert Interval(1.0, 0.5, math.inf).to_dict("V") == {"value": 1.0, "unit": "V", "ci95": [0.5, None]}
    assert Interval(1.23456789, 1.0, 2.0).to_dict() == {"value": 1.23457, "ci95": [1.0, 2.0]}


@given(st.floats(-1e3, 1e3), st.floats(1e-12, 1.0))
def test_rounding_does_not_hide_how_narrow_an_interval_is(value, half):
    told = Interval(value, value - half, value + half).to_dict()
    rounding = max(0.01 * half, 6e-16 * abs(value))  # half a unit of the sixteenth digit is 5e-16 at most
    assert told["value"] == pytest.approx(value, rel=0, abs=rounding)
    low, high = told["ci95"]
    assert high - low == pytest.approx(2.0 * half, rel=0, abs=max(0.02 * half, 1.5e-15 * abs(value)))
