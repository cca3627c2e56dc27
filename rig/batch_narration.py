"""How is a batch told in plain words on a terminal: while it goes on, and when it has ended?"""

from collections.abc import Iterator
from pathlib import Path

from rig.batch import Batch, State
from rig.narration import span

LISTED = 20  # failures told one by one


def under_way(job: str, state: State) -> str:
    """Return how far a batch is, in one line."""
    failed = f", {len(state.failures)} failed" if state.failures else ""
    left = "" if state.left_s is None else f", {span(float(f'{state.left_s:.2g}'))} left"
    return f"{job}: {state.done} of {state.total}{failed}{left}"


def batched(batch: Batch, state: State, table: Path) -> Iterator[str]:
    """Tell how a batch ended: what was done and why, what was not, what failed."""
    why = ", ".join(f"{count} {reason}" for reason, count in sorted(state.reasons.items()) if reason != "new")
    yield (f"{state.total} recordings: {state.answered} answered now{f' ({why})' if why else ''}, "
           f"{state.unchanged} before, {len(state.failures)} failed; {span(state.seconds)}")
    for path, message in state.failures[:LISTED]:
        yield f"  failed   {message if str(path) in message else f'{path}: {message}'}"
    if len(state.failures) > LISTED:
        yield f"  failed   and {len(state.failures) - LISTED} more, in the table"
    yield f"  answers  {batch.folder}"
    yield f"  table    {table}"
