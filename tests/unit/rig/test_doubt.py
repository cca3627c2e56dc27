"""Is the covariance in the JSON of an identification read back, and refused where it is none?"""

import json

import pytest

from identify.model import Backlash, Model, Rational
from identify.uncertainty.coefficients import coefficients
from rig.doubt import doubt_of
from rig.errors import FileError
from rig.rigfile import model_to_dict, model_to_yaml, parse_rig

MODEL = Model("rig", Rational((1.0,), (0.02, 1.0)), Backlash(8.0, 1.25, 8.0, -1.25), Rational((1.0,), (0.01, 1.0)))
KNOWN = tuple(coefficients(MODEL))


def answer(covariance: object) -> str:
    return json.dumps({"schema": "rig.identify/1", "model": model_to_dict(MODEL), "covariance": covariance})


def read(covariance: object):
    return doubt_of(parse_rig(answer(covariance), "answer.json"), KNOWN)


def test_a_covariance_is_read_with_its_names():
    doubt = read({"names": ["F.S_L", "G1.den.s1"], "matrix": [[1e-4, 2e-6], [2e-6, 1e-6]]})
    assert doubt is not None
    assert doubt.names == ("F.S_L", "G1.den.s1")
    assert doubt.matrix == ((1e-4, 2e-6), (2e-6, 1e-6))


@pytest.mark.parametrize("covariance", [None, {"names": ["F.S_L"], "matrix": [[None]]}, {"names": [], "matrix": []}])
def test_a_fit_that_gave_none_has_none(covariance):
    assert read(covariance) is None


def test_a_rig_file_has_none():
    assert doubt_of(parse_rig(model_to_yaml(MODEL), "rig.yaml"), KNOWN) is None


@pytest.mark.parametrize(
    ("covariance", "text"),
    [
        ({"names": ["F.S_X"], "matrix": [[1.0]]}, "a covariance of values that the model has not"),
        ({"names": ["F.S_L"], "matrix": [[1.0, 2.0]]}, "1 rows of 1 numbers"),
        ({"names": ["F.S_L"], "matrix": [["a"]]}, "1 rows of 1 numbers"),
        ({"names": ["F.S_L"], "matrix": [[0.0]]}, "not above 0"),
    ],
)
def test_what_is_no_covariance_is_refused(covariance, text):
    with pytest.raises(FileError, match=text):
        read(covariance)
