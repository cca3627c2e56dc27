"""What do the answers of a batch come to in one table, a line for every recording?

CSV; Parquet where the file is called so, for which pyarrow is needed. Nothing is computed here: every number is copied
from the answer it stands in.
"""

import csv
import io
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from rig.batch import Batch, State
from rig.errors import UsageError
from rig.outputs import check_destination, write_bytes
from rig.question import KEY
from rig.yamlfile import parse_json, read_text

Row = dict[str, str | float | int | bool | None]
TEXTS = ("recording", "status", "message", "result", "sha256", "verdict", "effects", "location")
BORDERS = ("S_L", "D_L", "S_U", "D_U")


def check_table(path: Path) -> None:
    """Raise UsageError for a table that could not be written at the end."""
    check_destination(path)
    if path.suffix == ".parquet":
        try:
            import pyarrow.parquet  # noqa: F401
        except ImportError as error:
            raise UsageError("pyarrow is not installed, and Parquet needs it", where=str(path),
                             do="pip install 'backlash-rig[parquet]', or name a table.csv") from error  # fmt: skip
    elif path.suffix != ".csv":
        raise UsageError("a table of this kind is not written", where=str(path), value=path.suffix or "no suffix",
                         allowed=".csv, .parquet")  # fmt: skip


def write(path: Path, batch: Batch, state: State) -> None:
    """Write the table in one move; raise FileError."""
    table = list(rows(batch, state))
    columns = list({key: None for row in table for key in row})
    write_bytes(path, _parquet(table, columns) if path.suffix == ".parquet" else _csv(table, columns))


def rows(batch: Batch, state: State) -> Iterator[Row]:
    """Yield a row for every recording: what became of it, and the numbers of its answer."""
    failed = dict(state.failures)
    for piece in batch.pieces:
        answer = {} if piece.recording in failed else _answer(piece.result)
        status, message = ("failed", failed[piece.recording]) if piece.recording in failed else ("answered", "")
        digest = answer.get(KEY, {}).get("recordings", [{}])[0].get("sha256", "")
        yield {
            "recording": str(piece.recording), "status": status, "message": message, "result": str(piece.result),
            "sha256": digest, **(_identified(answer) if batch.question.job == "identify" else _explained(answer)),
        }  # fmt: skip


def _answer(result: Path) -> Mapping[str, Any]:
    held: Any = parse_json(read_text(result), str(result)).data
    return dict(held)


def _identified(answer: Mapping[str, Any]) -> Row:
    """Return the numbers of ``rig identify``; none of an answer that is not there."""
    borders, fit = answer.get("backlash") or {}, answer.get("fit") or {}
    return {
        **_interval("delay_s", answer.get("delay_s")),
        **{k: v for name in BORDERS for k, v in _interval(_unit(name), borders.get(name)).items()},
        "rms_V": fit.get("rms_V"), "noise_rms_V": fit.get("noise_rms_V"), "fit_percent": fit.get("fit_percent"),
        "converged": fit.get("converged"), "warnings": len(answer["warnings"]) if answer else None,
    }  # fmt: skip


def _unit(border: str) -> str:
    return f"{border}_V" if border.startswith("D") else border


def _interval(name: str, told: Mapping[str, Any] | None) -> Row:
    """Return a value and both ends of its interval."""
    low, high = (told or {}).get("ci95", (None, None))
    return {name: (told or {}).get("value"), f"{name}_low95": low, f"{name}_high95": high}


def _explained(answer: Mapping[str, Any]) -> Row:
    """Return the verdict of ``rig explain`` and its proof."""
    effects = answer.get("effects") or []
    mismatch, held = answer.get("mismatch") or {}, (answer.get("fit") or {}).get("held_out") or {}
    return {
        "verdict": answer.get("verdict"), "effects": " ".join(f"{e['id']}@{e['stage']}" for e in effects),
        "probability": min((e["probability"] for e in effects), default=None),
        "location": (answer.get("location") or {}).get("stage"), "mismatch_V": mismatch.get("rms"),
        "over_noise": mismatch.get("over_noise"), "p_value": mismatch.get("p_value"),
        "noise_V": (answer.get("noise") or {}).get("rms"), "held_out_before_V": held.get("before"),
        "held_out_after_V": held.get("after"),
        "remaining_over_noise": (answer.get("remaining") or {}).get("over_noise"),
        "warnings": len(answer.get("warnings", ())) if answer else None,
    }  # fmt: skip


def _csv(table: Iterable[Row], columns: list[str]) -> bytes:
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(table)
    return text.getvalue().encode()


def _parquet(table: list[Row], columns: list[str]) -> bytes:
    import pyarrow
    from pyarrow import parquet

    kinds = {
        name: pyarrow.string() if name in TEXTS
        else pyarrow.bool_() if name == "converged"
        else pyarrow.int64() if name == "warnings" else pyarrow.float64()
        for name in columns
    }  # fmt: skip
    held = io.BytesIO()
    parquet.write_table(pyarrow.Table.from_pylist(table, pyarrow.schema(list(kinds.items()))), held)
    return held.getvalue()
