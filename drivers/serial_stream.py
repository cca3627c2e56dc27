"""Which samples has a run still to send, which has it received, and which must be asked for again?

No input or output here: what arrives is told, and what is to be sent is asked for, with the time as an argument.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from drivers.converter import Coded, Codes
from drivers.framing import Frame
from drivers.serial_messages import Condition, Kind, Status, pack_codes, pack_range, width
from drivers.window import Window
from rig.device import Flag

REPEAT_S, LONGEST_REPEAT_S, UNDER_WAY_S = 0.15, 0.6, 0.03
"""Wait before what was sent, or asked for, is sent or asked for again; frames are under way no longer than the last."""
REQUESTS = 10
"""How often a lost sample is asked for before it is given up."""
SAMPLES_PER_OUTPUT, FRAMES_AT_ONCE = 128, 64
FIFO_SHARE = 8
"""A frame is at most this part of the device's FIFO: a small FIFO is filled up in small steps."""
REQUESTS_AT_ONCE = 16

UNKNOWN, HERE, OVERRUN, LINK_LOSS = 0, 1, 2, 3
_FLAG = {HERE: Flag.NONE, OVERRUN: Flag.OVERRUN, LINK_LOSS: Flag.LINK_LOSS}


@final
class Outgoing:
    """Keeps the device's output FIFO ahead. ``window`` is the most samples under way without being acknowledged."""

    def __init__(self, codes: Codes | Coded, bits: int, fifo: int, window: int) -> None:
        """Start with nothing sent."""
        self._codes, self._bits, self._fifo = codes, bits, fifo
        self._most = max(1, min(SAMPLES_PER_OUTPUT, fifo // FIFO_SHARE))
        self._window = max(window, 2 * self._most)
        self._next = self._furthest = self._accepted = self._played = 0
        self._progress_s, self._repeats = 0.0, 0

    @property
    def filled(self) -> bool:
        """Return whether the device has all it can take before its clock starts."""
        return self._accepted >= min(self._codes.size, self._fifo)

    def heard(self, status: Status, now_s: float) -> None:
        """Note what the device took; go back to where it stopped following. Raise ValueError for what cannot be."""
        if not status.played <= status.accepted <= self._furthest:
            raise ValueError(f"{status.played} played, {status.accepted} accepted of {self._furthest} samples sent")
        advanced = status.accepted > self._accepted
        self._accepted, self._played = max(self._accepted, status.accepted), max(self._played, status.played)
        if advanced or self._next == self._accepted:
            self._progress_s, self._repeats = now_s, 0
        elif self._is_stuck(status, now_s):
            self._next, self._progress_s, self._repeats = self._accepted, now_s, self._repeats + 1

    def _is_stuck(self, status: Status, now_s: float) -> bool:
        """Return whether what the device did not take is to be sent again.

        A gap is told again as long as frames arrive that were under way when it began, which says nothing new. With no
        word of a gap each wait is longer than the one before, or a device that lags would drown in repetitions.
        """
        waited_s = now_s - self._progress_s
        if status.condition & Condition.GAP:
            return not self._repeats or waited_s > UNDER_WAY_S
        return waited_s > min(REPEAT_S * float(2**max(0, self._repeats - 1)), LONGEST_REPEAT_S)

    def due(self) -> list[Frame]:
        """Return the next frames of samples that fit the FIFO and the window, a few at a time."""
        first, room = self._next, min(self._played + self._fifo, self._accepted + self._window)
        stop = min(self._codes.size, room, first + FRAMES_AT_ONCE * self._most)
        if self._played and stop < self._codes.size:
            stop -= max(0, stop - first) % self._most
        if stop <= first:
            return []
        payload, size = pack_codes(self._codes[first:stop], self._bits), width(self._bits)
        self._next, self._furthest = stop, max(self._furthest, stop)
        return [Frame(Kind.OUTPUT, at, payload[(at - first) * size:(at + self._most - first) * size])
                for at in range(first, stop, self._most)]


@dataclass
class _Request:
    """A gap asked for again: where it began, how often it was asked for without effect, and when last."""

    start: int
    asked_s: float
    count: int = 1


@final
class Incoming:
    """Every sample of a run: not known yet, here, or lost and why."""

    def __init__(self, total: int, inputs: int = 1) -> None:
        """Start with nothing received of ``total`` samples, each of so many inputs."""
        self._total, self._inputs = total, inputs
        self._codes, self._state = Window(np.int32, inputs), Window(np.uint8)
        self._next = self._top = self._sent = 0
        self._requests: dict[int, _Request] = {}

    @property
    def settled(self) -> bool:
        """Return whether no sample is awaited of those the device sent so far."""
        return not self._gaps()

    def add(self, start: int, codes: Codes) -> int:
        """Note samples that arrived, input by input of each; return how many are new. ValueError: of another run."""
        samples = codes.reshape(-1, self._inputs)
        first, fresh = self._mark(start, start + len(samples), HERE)
        here, count = self._codes.part(first, first + fresh.size), int(np.count_nonzero(fresh))
        if count == fresh.size:
            here[:] = samples[first - start:]
        else:
            here[fresh] = samples[first - start:][fresh]
        return count

    def lost(self, start: int, stop: int, cause: int) -> None:
        """Note that the samples [start, stop) will not come; raise ValueError for another run's."""
        self._mark(start, stop, cause)

    def sent(self, until: int) -> None:
        """Note that the device sent, or skipped, all samples before ``until``."""
        self._sent = min(max(self._sent, until), self._total)

    def take(self) -> tuple[int, Codes, Flag] | None:
        """Return the next samples as (first number, codes (n, inputs), what happened before them), None without any.

        Codes are empty at the end of a run whose last samples are lost.
        """
        at, flags = self._next, Flag.NONE
        while at < self._top and (state := int(self._state.part(at, at + 1)[0])) != UNKNOWN:
            stop = self._end(at, state)
            flags |= _FLAG[state]
            if state == HERE or stop == self._total:
                start = at if state == HERE else stop
                codes = self._codes.part(start, stop).copy()
                self._forget(stop)
                return start, codes, flags
            at = stop
        return None

    def _forget(self, until: int) -> None:
        """Let go of the samples before ``until``, which were handed on."""
        self._next = until
        self._codes.forget(until)
        self._state.forget(until)

    def wanted(self, now_s: float) -> list[Frame]:
        """Return requests for the first gaps, when it is time to ask (again); one asked for too often is lost.

        A gap is known by its end: it fills from its beginning, or falls apart when the answer has a gap itself.
        """
        gaps, frames = self._gaps(), []
        self._requests = {stop: self._requests[stop] for _, stop in gaps if stop in self._requests}
        for start, stop in gaps:
            if self._to_ask(start, stop, now_s):
                frames.append(Frame(Kind.AGAIN, start, pack_range(start, stop)))
        return frames

    def _to_ask(self, start: int, stop: int, now_s: float) -> bool:
        """Return whether to ask for a gap now, and note it; give a hopeless one up."""
        request = self._requests.get(stop)
        if request is not None and now_s - request.asked_s < REPEAT_S:
            return False
        count = request.count + 1 if request is not None and request.start == start else 1
        if count > REQUESTS:
            self.lost(start, stop, LINK_LOSS)
            return False
        self._requests[stop] = _Request(start, now_s, count)
        return True

    def _gaps(self) -> list[tuple[int, int]]:
        """Return the first few [start, stop) not known in what was sent."""
        if self._next == self._sent:
            return []
        unknown = (self._state.part(self._next, self._top) == UNKNOWN).astype(np.int8)
        edges = np.flatnonzero(np.diff(unknown, prepend=0, append=0))[:2 * REQUESTS_AT_ONCE] + self._next
        gaps = [(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]
        return [*gaps, (self._top, self._sent)][:REQUESTS_AT_ONCE] if self._top < self._sent else gaps

    def _mark(self, start: int, stop: int, state: int) -> tuple[int, NDArray[np.bool_]]:
        """Give the unknown ones of the samples [start, stop) their state.

        Returns the first of them that was not handed on before, and which were unknown from there on.
        """
        if not 0 <= start <= stop <= self._total:
            raise ValueError(f"samples {start} to {stop} are not of this run")
        first, last = max(start, self._next), max(stop, self._next)
        held = self._state.part(first, last)
        fresh: NDArray[np.bool_] = held == UNKNOWN
        held[fresh] = state
        self._top = max(self._top, last)
        self.sent(stop)
        return first, fresh

    def _end(self, start: int, state: int) -> int:
        """Return where the samples in the ``state`` of the one at ``start`` end, within what is known."""
        other = self._state.part(start, self._top) != state
        return start + int(other.argmax()) if other.any() else self._top


def joined(frames: Iterable[Frame], sample_bytes: int) -> Iterator[Frame]:
    """Yield the frames, those of input samples that follow each other as one: few large pieces cost less."""
    held: list[Frame] = []
    stop = 0
    for frame in frames:
        count, rest = divmod(len(frame.payload), sample_bytes)
        if held and not (frame.kind == Kind.INPUT and frame.number == stop and not rest):
            yield _one(held)
            held = []
        if frame.kind == Kind.INPUT and not rest:
            held.append(frame)
            stop = frame.number + count
        else:
            yield frame
    if held:
        yield _one(held)


def _one(frames: list[Frame]) -> Frame:
    """Return frames that follow each other as one."""
    return Frame(frames[0].kind, frames[0].number, b"".join(frame.payload for frame in frames))
