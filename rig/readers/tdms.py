"""Which channels are in a TDMS file, the measurement file of National Instruments, and what does it say of them?

A channel is called ``GROUP/CHANNEL``. Its waveform properties are the time base, its unit is that of its numbers, and
scales that are kept with it are applied, which is said.
"""

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from nptdms import TdmsFile
from nptdms.log import log_manager

from identify.trace import blocks
from rig.readers.arrays import ArrayTable, Stand, Values, check_packing
from rig.readers.heading import SPELT, Heading
from rig.timebase import TimeBase

INCREMENT, OFFSET, UNIT, SCALES = "wf_increment", "wf_start_offset", "unit_string", "NI_Number_Of_Scales"


@dataclass(frozen=True, kw_only=True)
class TdmsTable(ArrayTable):
    """The channels of a TDMS file."""

    def stretch(self, stand: Stand, start: int, stop: int) -> Iterator[Values]:
        """Yield the rows [start, stop) of a channel."""
        group, channel = stand.array.split("\0")
        with TdmsFile.open(self.path) as file:
            for a, b in blocks(start, stop):
                values = np.asarray(file[group][channel].read_data(a, b - a))
                if values.size != b - a:
                    raise EOFError(f"channel {channel} ends at row {a + values.size} of {stand.rows}")
                yield values


def read_tdms(path: Path) -> TdmsTable:
    """Return the table; raise ValueError and its like for a damaged file."""
    log_manager.set_level(logging.CRITICAL)  # what it warns of on stderr is told here, or an error below
    with TdmsFile.open(path) as file:
        channels = [channel for group in file.groups() for channel in group.channels()]
        cut = file.file_status.incomplete_final_segment
        for channel in channels:
            check_packing(f"{path}: {channel.path}", (len(channel),), channel.dtype, path.stat().st_size)
        remarks = [f"{_name(channel)} scaled as the file says" for channel in channels if SCALES in channel.properties]
        remarks += ["the last segment was not finished: what is whole of it is read"] if cut else []
        return TdmsTable(
            where=str(path), path=path, clock=_clock(channels), remarks=tuple(remarks),
            headings=tuple(Heading(_name(channel), _name(channel), _unit(channel)) for channel in channels),
            stands=tuple(Stand(f"{c.group_name}\0{c.name}", len(c), c.dtype) for c in channels),
        )  # fmt: skip


def _name(channel: Any) -> str:
    return f"{channel.group_name}/{channel.name}"


def _unit(channel: Any) -> str:
    text = str(channel.properties.get(UNIT, "")).strip()
    return SPELT.get(text.lower(), text)


def _clock(channels: list[Any]) -> TimeBase | None:
    """Return the time base that all channels with one agree on."""
    told = {(float(c.properties.get(OFFSET, 0.0)), float(c.properties[INCREMENT])) for c in channels
            if float(c.properties.get(INCREMENT, 0.0)) > 0.0}
    if len(told) != 1:
        return None
    (start_s, increment_s), = told
    return TimeBase(start_s, 1.0 / increment_s)
