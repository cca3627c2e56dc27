"""How well does one unnamed law describe a real circuit? ``python -m tests.benchmarks.unnamed_law RECORDINGS``.

The benchmark of two filters with diodes between them (wh2009, see the README of the recordings): the rig file's linear
model, then the same with a free law of the level at F, sixteen knots, fitted on the training part. The last part is
looked at once.
"""

import sys
from pathlib import Path

import numpy as np

from identify.evidence import Evidence
from identify.explain.confirm import held_out_rms
from identify.explain.corrections import level_knots
from identify.explain.plain import prepared
from identify.holdout import split
from identify.observe import refined
from identify.stage import Place
from identify.starts.orders import valued
from identify.starts.start import stabilised
from identify.trace import Array, Trace
from identify.unnamed.maps import LevelMap
from rig.rigfile import read_rig

RATE_HZ = 51_200.0
TRAINING, PROOF = slice(5_200, 105_200), slice(109_200, 188_000)
KNOTS = 16


def trace(name: str, table: Array, rows: slice) -> Trace:
    """Return a stretch of the recording."""
    u, y = table[rows].T
    return Trace(name, RATE_HZ, u.copy(), y.copy(), "bandlimited", from_rest=False)


def table_of(path: Path) -> Array:
    """Return columns u and y, V."""
    lines = path.read_text(encoding="utf-8").splitlines()[1:]
    return np.array([[float(x) for x in line.split(",")[:2]] for line in lines if line.count(",") > 1])


def main(folder: Path) -> None:
    """Print what the linear model and the one with the unnamed law leave, in mV."""
    table = table_of(folder / "wh2009" / "WienerHammerBenchmark.csv")
    train, test = trace("training", table, TRAINING), trace("proof", table, PROOF)
    model, _ = stabilised(valued(read_rig(folder / "wh2009" / "rig.yaml").model, [train, test]))
    data = split(model, [train], [test])
    bench, plain = prepared(model, data)
    law = LevelMap(Place.F, level_knots(Evidence(plain.fit, bench.observations), Place.F, KNOTS))
    found = bench.fitted(law.put_in(plain.fit.chain), ())
    for name, fitted in (("linear", plain), ("with an unnamed law of the level at F", found)):
        held = held_out_rms(fitted.fit.chain, [refined(o, fitted.fit.chain) for o in data.test])
        print(f"{name}: held out {1e3 * held:.4g} mV, noise {1e3 * data.noise.rms_v:.3g} mV, {fitted.fit.sentence}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
