"""Which circuit of ideal parts is the plain rig of a rig file?

Transfer functions as such, and a play of a capacitor of 1 uF that ideal conductances of 1 S pull to the borders: within
microseconds. An integrator that shares nothing with ours then plays the rig (``spice:RIG.yaml``).
"""

from drivers.netlist import Netlist
from identify.model import Backlash, LinearF, NonlinearF, Rational
from rig.errors import FileError
from rig.rigfile import RigFile

HELD = ".ic v(h)=0"


def idealised(rig: RigFile) -> Netlist:
    """Return the circuit, with nodes u, v, w and y; raise FileError for physics no ideal part stands for."""
    model = rig.simulated()
    delayed = [block for block in (model.g1, model.g2) if block.dead_time_s]
    if model.physics or delayed:
        named = ", ".join(piece.id for piece in model.physics) or "a dead time"
        raise FileError("no ideal parts for this", where=rig.where, value=named,
                        allowed="a plain rig without dead time", do="describe the circuit by a netlist")
    lines = [*_block("1", model.g1, "u", "v"), *_between(model.f, rig.where), *_block("2", model.g2, "w", "y")]
    return Netlist(model.title, tuple(lines))


def _block(name: str, block: Rational, source: str, output: str) -> list[str]:
    """Return a transfer function, or a mere gain."""
    if len(block.den) == 1:
        return [f"E{name} {output} 0 {source} 0 {block.num[-1] / block.den[0]!r}"]
    num, den = (" ".join(map(repr, values)) for values in (block.num, block.den))
    rest = " ".join("0" for _ in block.den[1:])
    model = f"s_xfer(num_coeff=[{num}] den_coeff=[{den}] int_ic=[{rest}] denorm_freq=1)"
    return [f"A{name} {source} {output} block{name}", f".model block{name} {model}"]


def _between(f: NonlinearF | LinearF, where: str) -> list[str]:
    """Return F."""
    if isinstance(f, LinearF):
        return [f"B1 w 0 V={f.gain!r}*v(v)+({f.offset_v!r})"]
    if not isinstance(f, Backlash):
        raise FileError("no ideal parts for this", where=where, value="curved borders", allowed="straight borders")
    low, high = f"{f.s_l!r}*(v(v)-({f.d_l_v!r}))", f"{f.s_u!r}*(v(v)-({f.d_u_v!r}))"
    return [f"B1 0 h I=uramp({low}-v(h))-uramp(v(h)-{high})", "C1 h 0 1u", "R1 h 0 1e15", "E1 w 0 h 0 1", HELD]
