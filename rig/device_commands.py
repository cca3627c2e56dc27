"""What can be typed about devices: calibrate, devices, emulate.

Only click is imported here, as in ``rig.commands``.
"""

import click

from rig.typed import check_destinations, command, json_option, quantity_above_0, quiet_option, tell


@command(
    "calibrate", "rig calibrate serial:/dev/ttyACM0", "rig calibrate loopback:cable.yaml --rate 4kHz --out cal.json"
)
@click.argument("device", metavar="DEVICE")
@click.option("--rate", metavar="10kHz", default="10 kHz", show_default=True, help="The sample rate it is true at.")
@click.option("--level", metavar="1V", default="1 V", show_default=True, help="The largest level to put out.")
@click.option("--inputs", type=click.IntRange(1, 64), default=1, show_default=True, help="Inputs the cable joins.")
@click.option("--out", metavar="F.json", help="Where it is kept; else where rig run finds it.")
@json_option
@quiet_option
def calibrate(
    device: str, rate: str, level: str, inputs: int, out: str | None, json_to: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Measure a device with a cable from its output to its input.

    Tells delay, skew, gain, offset, noise and steps, each with its 95 % interval. rig run keeps them in its recordings,
    and rig identify and rig explain leave the known delay out of the rig's. A resistor and a capacitor of about one
    sample period in the cable tell the delay to a part of a sample; a plain cable only to the whole one.
    """
    from rig import calibrating, narration, summaries, terminal

    check_destinations(json_to)
    wish = calibrating.Wish(quantity_above_0("--rate", rate, "Hz"), quantity_above_0("--level", level, "V"), inputs)
    with terminal.bar("calibrating", quiet) as progress:
        done = calibrating.calibrate(device, wish, out, progress)
    tell(json_to, lambda: summaries.calibrate(done), lambda: narration.calibrated(done))


@command("devices", "rig devices", "rig devices --json -")
@json_option
@quiet_option
def devices(json_to: str | None, quiet: bool) -> None:
    """List what is attached, by identity."""
    from rig import narration, registry, summaries, terminal

    check_destinations(json_to)
    with terminal.bar("asking who is there", quiet) as show:
        found = registry.discover(show)
    tell(json_to, lambda: summaries.devices(found), lambda: narration.devices(found))


@command("emulate", "rig emulate serial", "rig emulate serial --rig rigs/opamp_backlash.yaml --speed 10")
@click.argument("kind")
@click.option("--rig", default="rigs/opamp_backlash.yaml", show_default=True, help="The rig it is wired to.")
@click.option("--speed", type=click.FloatRange(0.1, 1e3), default=1.0, show_default=True, help="Speed of its clock.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Draws other noise.")
def emulate(kind: str, rig: str, speed: float, seed: int) -> None:
    """Offer an emulated device until Ctrl-C.

    KIND is that of its address, such as serial. It is byte-accurate, on a real port; its address is printed first.
    """
    from rig.emulation import emulate as offer
    from rig.rigfile import read_rig
    from rig.session import shipped

    offer(kind, read_rig(shipped(rig)), click.echo, speed, seed)
