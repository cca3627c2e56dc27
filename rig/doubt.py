"""How sure are the values of the model in the JSON of an identification?"""

from math import isfinite
from typing import Any

from identify.model import Doubt
from rig.rigfile import RigFile
from rig.yamlfile import Document, parse_json

KEY = "covariance"


def doubt_of(rig: RigFile, known: tuple[str, ...]) -> Doubt | None:
    """Return the covariance that stands beside a model, None where there is none or the fit gave none.

    ``known`` are the values the model has. Raises FileError for one that is no covariance of some of them.
    """
    if not rig.text.lstrip().startswith("{"):
        return None
    document = parse_json(rig.text, rig.where)
    found = document.data.get(KEY) if isinstance(document.data, dict) else None
    if not isinstance(found, dict):
        return None
    names, rows = found.get("names"), found.get("matrix")
    if not isinstance(names, list) or not all(name in known for name in names):
        raise document.error("a covariance of values that the model has not", KEY, "names", allowed=", ".join(known))
    if names == [] or _lacks_numbers(rows):
        return None
    return Doubt(tuple(names), _square(document, rows, len(names)))


def _lacks_numbers(rows: Any) -> bool:
    """Return whether a fit that failed left nothing where its covariance would stand."""
    return isinstance(rows, list) and any(isinstance(row, list) and None in row for row in rows)


def _square(document: Document, rows: Any, size: int) -> tuple[tuple[float, ...], ...]:
    """Return the matrix; raise FileError for one of another shape, or with a variance that is not above 0."""
    shaped = isinstance(rows, list) and len(rows) == size and all(isinstance(r, list) and len(r) == size for r in rows)
    if not shaped or not all(isinstance(v, int | float) and isfinite(v) for row in rows for v in row):
        raise document.error("not a matrix of numbers", KEY, "matrix", allowed=f"{size} rows of {size} numbers")
    if any(rows[i][i] <= 0.0 for i in range(size)):
        raise document.error("a variance is not above 0", KEY, "matrix")
    return tuple(tuple(float(v) for v in row) for row in rows)
