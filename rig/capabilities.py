"""Who is a device, and what can it do?"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Identity:
    """Who the device is, as it says itself."""

    model: str
    serial: str
    firmware: str

    def __str__(self) -> str:
        """Return the identity in one line."""
        return f"{self.model} serial {self.serial} firmware {self.firmware}"


@dataclass(frozen=True)
class Capabilities:
    """What the device can do. ``buffer_samples`` None: nothing to overrun. ``max_samples`` None: runs of any length.

    Of its ``inputs`` a run records the first few; their rates add up to ``max_total_rate_hz`` at most, None: no bound.
    ``output_step_v`` is the step of the output in V where range and bits do not tell it.
    ``multiplexed``: one converter reads them in turn, each input 1 / n of a sample period after the one before.
    """

    output_low_v: float
    output_high_v: float
    input_low_v: float
    input_high_v: float
    min_rate_hz: float
    max_rate_hz: float
    output_bits: int
    input_bits: int
    buffer_samples: int | None = None
    max_samples: int | None = None
    inputs: int = 1
    max_total_rate_hz: float | None = None
    output_step_v: float | None = None
    multiplexed: bool = False

    def skews(self, inputs: int) -> tuple[float, ...]:
        """Return how much later than the first each of so many inputs is read, in sample periods."""
        return tuple(place / inputs if self.multiplexed else 0.0 for place in range(inputs))

    @property
    def output_lsb_v(self) -> float:
        """Return the step of the DAC in V: codes are symmetric, 0 V and both ends of the range are exact."""
        if self.output_step_v is not None:
            return self.output_step_v
        return (self.output_high_v - self.output_low_v) / float((1 << self.output_bits) - 2)

    @property
    def input_lsb_v(self) -> float:
        """Return the step of the ADC in V, by the same rule as the DAC."""
        return (self.input_high_v - self.input_low_v) / float((1 << self.input_bits) - 2)
