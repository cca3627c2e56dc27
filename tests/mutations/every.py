"""Which cases are there of all kinds together, those made to harm first, then damage at random without end?"""

from collections.abc import Iterator
from itertools import chain, islice
from random import Random

from tests.mutations import damage
from tests.mutations.case import Case
from tests.mutations.originals import CHECK, PROTOCOL, RIG, TABLE, Originals
from tests.mutations.recordings import damaged_recordings, damaged_structures, hostile_recordings
from tests.mutations.tables import damaged_tables, hostile_tables
from tests.mutations.texts import hostile_answers, hostile_protocols, hostile_rigs, hostile_words


def hostile(originals: Originals, every: int = 1) -> Iterator[Case]:
    """Yield one in ``every`` of all files made to harm."""
    words = chain(hostile_words(originals), hostile_protocols(), hostile_rigs(originals), hostile_answers(originals))
    return chain(islice(words, 0, None, every), hostile_recordings(originals, every),
                 islice(hostile_tables(), 0, None, every))


def damaged(originals: Originals, chance: Random) -> Iterator[Case]:
    """Yield damage of one kind of file after the other, without end."""
    kinds = (damaged_words(originals, chance), damaged_recordings(originals, chance),
             damaged_structures(originals, chance), damaged_tables(chance))
    while True:
        for kind in kinds:
            yield from islice(kind, 3)


def damaged_words(originals: Originals, chance: Random) -> Iterator[Case]:
    """Yield protocols, rigs, tables beside them, answers and calibrations with damage, without end."""
    while True:
        harm = chance.choice(damage.OF_TEXT)
        files = {"p.yaml": PROTOCOL.encode(), "rig.yaml": RIG.encode(), "t.csv": TABLE.encode()}
        name = chance.choice(list(files))
        yield Case(f"{name}: {harm.__name__}", files | {name: harm(files[name], chance)}, CHECK)
        model = harm(chance.choice([originals.answer, RIG.encode()]), chance)
        yield Case(f"model: {harm.__name__}", {"run.h5": originals.run, "model.json": model},
                   ("simulate", "run.h5", "--rig", "model.json", "--out", "y.csv"))
        known = harm(originals.calibration, chance)
        yield Case(f"calibration: {harm.__name__}", {"run.h5": originals.run, "c.json": known},
                   ("identify", "run.h5", "--calibration", "c.json"))
