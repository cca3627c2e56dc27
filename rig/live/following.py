"""What has come into a recording since it was last looked at, and how does its run stand?

Of a recording that grows the bytes that do not grow are compared, and its samples are read past the HDF5 library
as they are acknowledged, through one descriptor that is kept: the run never waits for who reads it, and where the
finished file takes the place of the one that grew, that one is read to its end. A finished recording is followed from
its first sample to its last in the same way.
"""

import os
import sys
import weakref
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import final

import h5py
import numpy as np
from numpy.typing import NDArray

from identify.trace import Array, Intersample, Samples, Step
from rig.journal import JOURNAL, STRETCH, shape_of
from rig.recorded import Event, Initial, Recording
from rig.recording import DAMAGE, judged, read, told
from rig.recordingfile import FURTHER, LEDGER, begun
from rig.samples import InFile
from rig.seal import Seal
from rig.unfinished import LEFT, STILL, inspect, spoken
from rig.writing import is_written

AT_ONCE = 1 << 15  # samples handed on together
LOOKS = 5  # at a file that may be finished and replaced meanwhile


@dataclass(frozen=True)
class About:
    """What is known of a run from its beginning on: of its samples only how many there are to be."""

    name: str
    title: str
    question: str
    size: int
    rate_hz: float
    steps: tuple[Step, ...]
    intersample: Intersample
    initial: Initial
    start_s: float
    address: str
    model: str
    started: str
    ranges_v: tuple[float, ...] | None
    protocol_text: str
    rig_text: str

    @classmethod
    def of(cls, recording: Recording) -> "About":
        """Return what a recording knows beside its samples."""
        device = recording.origin.equipment
        return cls(recording.name, recording.title, recording.question, recording.u.size, recording.rate_hz,
                   recording.steps, recording.intersample, recording.initial, recording.start_s, device.address,
                   device.model, recording.origin.started, device.ranges_v, recording.protocol_text,
                   recording.rig_text)


@dataclass(frozen=True)
class Stretch:
    """Samples [first, first + n) of a run: u, V, shape (n,), and every input by name, V, NaN where nothing came.

    ``entries`` (n,) is the ledger.
    """

    first: int
    u: Array
    inputs: Mapping[str, Array]
    entries: NDArray[np.uint8]


@dataclass(frozen=True)
class Standing:
    """How far a run has come, and whether a program is recording it now; how it ended, where that is known."""

    acknowledged: int
    going_on: bool
    complete: bool
    reason: str
    events: tuple[Event, ...]


class Following(ABC):
    """A recording that is read from its first sample on, in memory that does not grow with it."""

    def __init__(self, about: About, file: os.stat_result) -> None:
        """Begin at the first sample of the recording in ``file``."""
        self.about = about
        self.file = file
        self.position = 0

    @abstractmethod
    def standing(self) -> Standing:
        """Return how the run stands now; raise OSError."""

    @abstractmethod
    def _stretch(self, first: int, stop: int) -> Stretch:
        """Return samples that were acknowledged."""

    @property
    @abstractmethod
    def further(self) -> tuple[str, ...]:
        """Return the names of the inputs beside y."""

    @final
    def news(self, standing: Standing) -> Iterator[Stretch]:
        """Yield what was acknowledged since the last call, a stretch at a time, for as long as the caller goes on."""
        while self.position < standing.acknowledged:
            first = self.position
            self.position = min(first + AT_ONCE, standing.acknowledged)
            yield self._stretch(first, self.position)


def follow(path: Path) -> Following:
    """Return the recording at ``path`` to be followed; raise FileError for what is none, or damaged."""
    with told(path):
        for _ in range(LOOKS):
            if judged(path) is not Seal.GROWING:
                break
            try:
                return _Growing(path)
            except DAMAGE:
                continue  # finished and replaced meanwhile, or damaged: then it is read below, and that says so
        return _Finished(read(path), path.stat())


@final
class _Finished(Following):
    """A recording to which nothing comes any more."""

    def __init__(self, recording: Recording, file: os.stat_result) -> None:
        super().__init__(About.of(recording), file)
        self._u, self._inputs, self._ledger = recording.u, recording.inputs(), recording.ledger
        self._stands = Standing(recording.u.size, False, recording.complete, recording.reason, recording.events)

    @property
    def further(self) -> tuple[str, ...]:
        return tuple(self._inputs)[1:]

    def standing(self) -> Standing:
        return self._stands

    def _stretch(self, first: int, stop: int) -> Stretch:
        inputs = {name: signal[first:stop] for name, signal in self._inputs.items()}
        return Stretch(first, self._u[first:stop], inputs, self._ledger[first:stop])


@final
class _Growing(Following):
    """A recording that a program writes, or left as it was when it was killed."""

    def __init__(self, path: Path) -> None:
        """Open it; raise OSError, HarmedError and their like for what is finished meanwhile, or damaged."""
        self._file = path.open("rb", buffering=0)
        weakref.finalize(self, self._file.close)
        self._extents = inspect(path).extents
        with h5py.File(path, "r") as file:
            recording = begun(file, path.stem)
        if not os.path.samestat(os.fstat(self._file.fileno()), path.stat()):
            raise OSError("the recording was replaced while it was opened")
        super().__init__(About.of(recording), os.fstat(self._file.fileno()))
        self._u: Samples | int = recording.u.offset if isinstance(recording.u, InFile) else recording.u
        columns = [name for name in self._extents if name != JOURNAL]
        self._row_bytes, self._rows = 8 * shape_of(self.about.size, columns)[1], 0

    @property
    def further(self) -> tuple[str, ...]:
        return tuple(_input_name(name) for name in self._extents if name not in (LEDGER, JOURNAL, "y"))

    def standing(self) -> Standing:
        words, going_on = spoken(self._file), is_written(self._file)
        count = self._acknowledged()  # after that: of a run that ended it is all
        if words is None:
            return Standing(count, going_on, False, STILL if going_on else LEFT, ())
        return Standing(count, False, words.complete, words.reason, words.events)

    def _acknowledged(self) -> int:
        """Return how many samples the journal accounts for; rows that are full are not looked at again."""
        while True:
            at = self._extents[JOURNAL][0] + self._rows * self._row_bytes
            count = int.from_bytes(os.pread(self._file.fileno(), 8, at), sys.byteorder)
            last = self._rows * STRETCH + count
            if count < STRETCH or last >= self.about.size:
                return last
            self._rows += 1

    def _stretch(self, first: int, stop: int) -> Stretch:
        inputs = {_input_name(name): self._signal(offset, first, stop)
                  for name, (offset, _) in self._extents.items() if name not in (LEDGER, JOURNAL)}
        u = self._signal(self._u, first, stop) if isinstance(self._u, int) else self._u[first:stop]
        ledger = os.pread(self._file.fileno(), stop - first, self._extents[LEDGER][0] + first)
        return Stretch(first, u, inputs, np.frombuffer(ledger, np.uint8))

    def _signal(self, offset: int, first: int, stop: int) -> Array:
        """Return the samples [first, stop) of a signal of float64 from byte ``offset`` on."""
        return np.frombuffer(os.pread(self._file.fileno(), 8 * (stop - first), offset + 8 * first), np.float64)


def _input_name(dataset: str) -> str:
    """Return the input whose readings stand in a dataset."""
    return dataset.removeprefix(f"{FURTHER}/")
