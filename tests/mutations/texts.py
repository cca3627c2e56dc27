"""Which protocols, rig files, answers and calibrations are made to harm whoever reads them?"""

import json
from collections.abc import Iterator
from pathlib import Path

from tests.mutations.case import Case
from tests.mutations.originals import CHECK, PROTOCOL, RIG, Originals

ALIASES = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{chr(98 + k)}: &{chr(98 + k)} [{','.join([f'*{chr(97 + k)}'] * 9)}]\n" for k in range(9)
)
DEEP = 100_000
EVERYWHERE = {  # what no file of words may be
    "aliases that multiply": ALIASES,
    "an alias of itself": "a: &a [*a]\n",
    "a merge key": "base: &b {spec: 1}\n<<: *b\n",
    "an object": "!!python/object/apply:os.system ['touch pwned']\n",
    "an object below": "spec: !!python/name:os.system\n",
    "a set": "spec: !!set {1}\n",
    "a tag directive": "%TAG ! tag:yaml.org,2002:python/\n---\n!object/apply:os.system ['touch pwned']\n",
    "a YAML of the future": "%YAML 9.9\n---\nspec: 1\n",
    "lists in lists": "[" * DEEP,
    "maps in maps": "{a: " * DEEP,
    "steps in steps": "\n".join(" " * k + "a:" for k in range(2000)) + "\n",
    "lists by dashes": "- " * DEEP + "\n",
    "JSON in JSON": '{"a":' * DEEP + "1" + "}" * DEEP,
    "JSON lists": '{"a":' + "[" * DEEP + "]" * DEEP + "}",
    "a key twice": "spec: 1\nspec: 1\n",
    "a key in JSON twice": '{"spec": 1, "spec": 1}',
    "a list for a key": "? [1, 2]\n: 3\n",
    "a map for a key": "? {a: 1}\n: 3\n",
    "two documents": "spec: 1\n---\nspec: 1\n",
    "only a number": "1\n",
    "only text": "spec\n",
    "only a list": "[1, 2]\n",
    "nothing": "",
    "blanks": " \n" * 1000,
    "a comment": "# spec: 1\n",
    "a mark only": "\ufeff",
    "a NUL": "spec: 1\0\n",
    "a bell": "spec: \a\n",
    "an escaped NUL": 'spec: 1\ntitle: "\\0"\n',
    "half a pair": '{"spec": "\\ud800"}',
    "a huge key": f"{'k' * 200_000}: 1\n",
    "a huge number": f"spec: {'9' * 1_000_000}\n",
    "a huge number in JSON": f'{{"spec": {"9" * 1_000_000}}}',
    "a huge exponent": "spec: 1e999999999\n",
    "JSON of NaN": '{"spec": NaN}',
    "JSON of Infinity": '{"spec": Infinity}',
    "many keys": "".join(f"k{k}: 1\n" for k in range(100_000)),
    "too large": "# " + "x" * 5_000_000 + "\nspec: 1\n",
    "a date": "spec: 2026-11-22\n",
    "a truth": "spec: true\n",
    "one and a bit": "spec: 1.0000001\n",
}
NO_TEXT = {
    "UTF-16": "spec: 1\n".encode("utf-16"),
    "Latin-1": b"spec: 1\ntitle: gr\xf6\xdfe\n",
    "bytes": bytes(range(256)) * 64,
    "gzip": b"\x1f\x8b" + bytes(200),
    "zeros": bytes(100_000),
}


def hostile_words(originals: Originals) -> Iterator[Case]:
    """Yield what is wrong as any file of words, opened by everything that opens one."""
    every = {name: text.encode("utf-8", "surrogatepass") for name, text in EVERYWHERE.items()} | NO_TEXT
    for name, held in every.items():
        yield Case(f"protocol: {name}", {"p.yaml": held, "rig.yaml": RIG.encode()}, CHECK, hostile=True)
        yield Case(f"rig file: {name}", {"p.yaml": PROTOCOL.encode(), "rig.yaml": held}, CHECK, hostile=True)
        yield Case(
            f"model: {name}",
            {"run.h5": originals.run, "model.json": held},
            ("simulate", "run.h5", "--rig", "model.json"),
            hostile=True,
        )
        yield Case(
            f"calibration: {name}",
            {"run.h5": originals.run, "c.json": held},
            ("identify", "run.h5", "--calibration", "c.json"),
            hostile=True,
        )


STEPS = {  # one step of a protocol each
    "no sine": "sine: 3",
    "a sine of lists": "sine: {frequency: [1 Hz], amplitude: 1 V, periods: 1}",
    "NaN volts": "hold: {level: nan V, time: 1 s}",
    "infinite volts": "hold: {level: .inf, time: 1 s}",
    "1e999 volts": "hold: {level: 1e999 V, time: 1 s}",
    "a bare number": "hold: {level: 1, time: 1 s}",
    "a time below 0": "hold: {level: 1 V, time: -1 s}",
    "no time": "hold: {level: 1 V, time: 0 s}",
    "years": "hold: {level: 1 V, time: 1e300 s}",
    "a light second": "hold: {level: 1 V, time: 1 lightyear}",
    "an expression": "hold: {level: 1 V, time: '1 s**9**9**9'}",
    "a power": "hold: {level: '1 V^9', time: 1 s}",
    "many units": f"hold: {{level: '1 {'/'.join(['V'] * 3000)}', time: 1 s}}",
    "ten million periods": "sine: {frequency: 1 Hz, amplitude: 1 V, periods: 10000000}",
    "a staircase without end": "staircase: {levels: [{from: 0 V, to: 1 V, step: 1e-12 V}], dwell: 1 ms}",
    "a staircase of nothing": "staircase: {levels: [], dwell: 1 ms}",
    "a range that does not end": "staircase: {levels: [{from: 0 V, to: 1 V, step: 1e-320 V}], dwell: 1 ms}",
    "steps backwards": "staircase: {levels: [{from: 0 V, to: 1 V, step: -0.1 V}], dwell: 1 ms}",
    "settled never": "staircase: {levels: [1 V], dwell: {settle: 0 %}}",
    "half settled": "staircase: {levels: [1 V], dwell: {settle: 1e-300}}",
    "a truth for a level": "hold: {level: true, time: 1 s}",
    "two stimuli": "{hold: {level: 1 V, time: 1 s}, sine: {}}",
    "a line below 0": "multisine: {frequencies: [-1 Hz], periods: 1, peak: 1 V}",
    "no lines": "multisine: {frequencies: [], periods: 1, peak: 1 V}",
    "loops of nothing": "minor_loops: {amplitudes: [], slope: 1 V/s}",
    "loops without end": "minor_loops: {amplitudes: [1 V], slope: 1 V/s, loops: 1000000000}",
    "times backwards": "table: {times: [0 s, 2 s, 1 s], levels: [1 V, 1 V, 1 V]}",
    "uneven columns": "table: {times: [0 s, 1 s], levels: [1 V]}",
    "a file elsewhere": "table: {file: {path: ../outside}}",
    "a file of the system": "table: {file: {path: /etc/hostname}}",
    "a folder": "table: {file: {path: .}}",
    "a device": "table: {file: {path: /dev/zero}}",
    "itself": "table: {file: {path: p.yaml}}",
    "a NUL": 'table: {file: {path: "a\\0b"}}',
    "a long name": f"table: {{file: {{path: {'n' * 5000}}}}}",
    "column -1": "table: {file: {path: t.csv, time: -1}}",
    "a label of lines": 'label: "\\r\\n"',
    "a huge repeat": "{repeats: 99999999999999999999, hold: {level: 1 V, time: 1 s}}",
    "an arabic number": "hold: {level: \u0663 V, time: 1 s}",
    "a fullwidth unit": "hold: {level: 1 \uff36, time: 1 s}",
    "no step": "null",
    "a list": "[1]",
}
TOPS = {  # one key of a protocol each: what is replaced, by what
    "a rig elsewhere": ("rig: rig.yaml", "rig: ../outside"),
    "a rig of the system": ("rig: rig.yaml", "rig: /etc/hostname"),
    "a rig that is a folder": ("rig: rig.yaml", "rig: ."),
    "itself": ("rig: rig.yaml", "rig: p.yaml"),
    "code for a device": ("rig: rig.yaml", "rig: rig.yaml\ndevice: 'antigravity:Fly'"),
    "a device elsewhere": ("rig: rig.yaml", "rig: rig.yaml\ndevice: 'loopback:../outside'"),
    "a replay elsewhere": ("rig: rig.yaml", "rig: rig.yaml\ndevice: 'replay:../outside'"),
    "no device": ("rig: rig.yaml", "rig: rig.yaml\ndevice: ''"),
    "a device of lines": ("rig: rig.yaml", 'rig: rig.yaml\ndevice: "loopback:\\n"'),
    "an infinite rate": ("4 kHz", "1e999 Hz"),
    "no rate": ("4 kHz", "0 Hz"),
    "a rate below 0": ("4 kHz", "-1 Hz"),
    "a product": ("4 kHz", "99999999999999999999 x 1e300 Hz"),
    "a huge product": ("4 kHz", f"{'9' * 400} x 1 Hz"),
    "limits of nothing": ("{level: 9 V}", "{level: 0 V}"),
    "limits exchanged": ("{level: 9 V}", "{low: 1 V, high: -1 V}"),
    "no limits": ("{level: 9 V}", "{}"),
    "endless limits": ("{level: 9 V}", "{level: 1e400 V}"),
    "spec 2": ("spec: 1", "spec: 2"),
    "spec '1'": ("spec: 1", "spec: '1'"),
    "no title": ("title: short", "title: ''"),
    "no question": ("question: Is it read?", "question: "),
    "a huge repeat": ("spec: 1", "spec: 1\nrepeats: 999999999999"),
    "retry for ever": ("spec: 1", "spec: 1\non_overrun: retry 100"),
    "inputs without end": ("rate: 4 kHz", f"rate: 4 kHz, inputs: [y, {', '.join(f'x{k}' for k in range(20_000))}]"),
    "an input elsewhere": ("rate: 4 kHz", "rate: 4 kHz, inputs: [y, ../../x]"),
    "an unknown key": ("spec: 1", "spec: 1\n__class__: x"),
}


def hostile_protocols() -> Iterator[Case]:
    """Yield protocols that must be refused as files, not as something a device cannot play."""
    for name, step in STEPS.items():
        text = f"{PROTOCOL[: PROTOCOL.index('steps:')]}steps:\n  - {step}\n"
        yield Case(f"protocol: {name}", _beside(text), CHECK, hostile=name not in TOO_MUCH)
    for name, (old, new) in TOPS.items():
        yield Case(f"protocol: {name}", _beside(PROTOCOL.replace(old, new, 1)), CHECK, hostile=name not in TOO_MUCH)


TOO_MUCH = {
    "years",
    "half settled",
    "times backwards",
    "uneven columns",
    "inputs without end",
    "a staircase without end",
    "a range that does not end",
}
"""What is refused as well, as more than can be played or as not drawn: a negative answer, exit code 1."""


def _beside(text: str) -> dict[str, bytes]:
    return {"p.yaml": text.encode(), "rig.yaml": RIG.encode(), "t.csv": b"0,1\n1,1\n"}


RIGS = {  # what is replaced in a rig file, by what
    "no den": ("den: [0.01, 1]", "den: []"),
    "den of 0": ("den: [0.01, 1]", "den: [0, 0]"),
    "den of NaN": ("den: [0.01, 1]", "den: [.nan, 1]"),
    "den of inf": ("den: [0.01, 1]", "den: [1e999, 1]"),
    "den of text": ("den: [0.01, 1]", "den: [a, 1]"),
    "den of truths": ("den: [0.01, 1]", "den: [true, true]"),
    "a num too long": ("num: [1]", f"num: [{', '.join(['1'] * 10_000)}]"),
    "unstable": ("den: [0.01, 1]", "den: [-0.01, 1]"),
    "more zeros than poles": ("num: [1]", "num: [1, 1, 1, 1]"),
    "a delay below 0": ("den: [0.01, 1]", "den: [0.01, 1], dead_time: -1 s"),
    "an endless delay": ("den: [0.01, 1]", "den: [0.01, 1], dead_time: 1e999 s"),
    "a huge order": ("{num: [1], den: [0.01, 1]}", "{order: 99999999999999999999}"),
    "an order below 0": ("{num: [1], den: [0.01, 1]}", "{order: -1}"),
    "two kinds of F": ("linear: {", "backlash: unknown, linear: {"),
    "F of nothing": ("{linear: {gain: 2, offset: 0 V}}", "{}"),
    "F of a number": ("{linear: {gain: 2, offset: 0 V}}", "3"),
    "borders exchanged": ("{linear: {gain: 2, offset: 0 V}}", "{backlash: {S_L: 1, D_L: -1 V, S_U: 1, D_U: 1 V}}"),
    "a border that falls": ("{linear: {gain: 2, offset: 0 V}}", "{backlash: {S_L: -1, D_L: 1 V, S_U: 1, D_U: -1 V}}"),
    "a curve of one point": (
        "{linear: {gain: 2, offset: 0 V}}",
        "{curved_backlash: {L: [[0 V, 0 V]], U: [[0 V, 0 V]]}}",
    ),
    "curves that cross": (
        "{linear: {gain: 2, offset: 0 V}}",
        "{curved_backlash: {L: [[0 V, 0 V], [1 V, 9 V]], U: [[0 V, 1 V], [1 V, 2 V]]}}",
    ),
    "noise below 0": ("noise: 10 mV", "noise: -1 V"),
    "noise of NaN": ("noise: 10 mV", "noise: nan V"),
    "unknown physics": ("noise: 10 mV", "noise: 10 mV\nphysics: {os.system: {a: 1}}"),
    "physics of a list": ("noise: 10 mV", "noise: 10 mV\nphysics: [saturation]"),
    "physics of nothing": ("noise: 10 mV", "noise: 10 mV\nphysics: {saturation: {}}"),
    "physics of NaN": ("noise: 10 mV", "noise: 10 mV\nphysics: {saturation: {upper: nan V}}"),
    "physics nowhere": ("noise: 10 mV", "noise: 10 mV\nphysics: {saturation: {upper: 1 V, stage: ../F}}"),
    "unnamed physics": ("noise: 10 mV", "noise: 10 mV\nphysics: {unnamed: {a: 1}}"),
    "fixed what is not": ("noise: 10 mV", "noise: 10 mV\nfixed: [__class__]"),
    "fixed lists": ("noise: 10 mV", "noise: 10 mV\nfixed: [[G1]]"),
    "no amplifier": ("noise: 10 mV", "noise: 10 mV\namplifier: {gain: 0, range: 1 V}"),
    "an endless amplifier": ("noise: 10 mV", "noise: 10 mV\namplifier: {gain: 1e999, range: 1 V}"),
    "no room": ("noise: 10 mV", "noise: 10 mV\nlimits: {low: 8 V, high: 7 V}"),
}


def hostile_rigs(originals: Originals) -> Iterator[Case]:
    """Yield rig files that must be refused, read for a protocol and for a recording."""
    for name, (old, new) in RIGS.items():
        assert old in RIG
        held = RIG.replace(old, new, 1).encode()
        yield Case(f"rig file: {name}", {"p.yaml": PROTOCOL.encode(), "rig.yaml": held}, CHECK, hostile=True)
        yield Case(
            f"rig file of a run: {name}",
            {"run.h5": originals.run, "rig.yaml": held},
            ("simulate", "run.h5", "--rig", "rig.yaml"),
            hostile=True,
        )


def hostile_answers(originals: Originals) -> Iterator[Case]:
    """Yield answers of ``rig identify`` in which one value after the other, of what is read again, became another."""
    answer = json.loads(originals.answer)
    wrong: tuple[object, ...] = (None, [], {}, "x", -1, 1e308, True, [[]], float("nan"), 10**400)
    for key, bad in ((key, bad) for key in ("model", "covariance") for bad in wrong):
        yield _of_answer(originals, f"{key} {_short(bad)}", {**answer, key: bad}, hostile=False)
    for key, bad in ((key, bad) for key in answer["covariance"] for bad in wrong):
        changed = {**answer, "covariance": {**answer["covariance"], key: bad}}
        yield _of_answer(originals, f"covariance.{key} {_short(bad)}", changed, hostile=False)
    for key, bad in ((key, bad) for key in answer["model"] for bad in wrong):
        changed = {**answer, "model": {**answer["model"], key: bad}}
        yield _of_answer(originals, f"model.{key} {_short(bad)}", changed, hostile=False)


def _short(bad: object) -> str:
    return repr(bad)[:20] if not isinstance(bad, int) or bad < 10**9 else "a huge integer"


def _of_answer(originals: Originals, name: str, changed: object, *, hostile: bool) -> Case:
    held = json.dumps(changed).encode() if "huge integer" not in name else _dumped(changed)
    return Case(
        f"answer: {name}",
        {"run.h5": originals.run, "model.json": held},
        ("simulate", "run.h5", "--rig", "model.json", "--out", "y.csv"),
        hostile,
    )


def _dumped(changed: object) -> bytes:
    """Return JSON with an integer that Python does not print."""
    return json.dumps(_named(changed)).replace('"HUGE"', "1" + "0" * 5000).encode()


def _named(node: object) -> object:
    if isinstance(node, dict):
        return {key: _named(value) for key, value in node.items()}
    if isinstance(node, list):
        return [_named(value) for value in node]
    return "HUGE" if isinstance(node, int) and not isinstance(node, bool) and node > 10**9 else node


def shipped(name: str) -> bytes:
    """Return a protocol or rig that comes with the program."""
    import protocols

    return (Path(protocols.__path__[0]) / name).read_bytes()
