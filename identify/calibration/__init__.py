"""What does a cable from the output to the input tell of the converters at its ends?"""

from identify.calibration.cable import Cable, Pass, at_once, measured

__all__ = ["Cable", "Pass", "at_once", "measured"]
