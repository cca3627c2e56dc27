"""Which examples do property tests look at, where do tests lock ports, and which calibrations are there?

The same examples every time: what passes here passes there. Every process of tests locks ports in a folder of its own:
devices emulated inside a test have one name in all of them. No test finds a calibration that somebody made here.
"""

import os
import tempfile

from hypothesis import settings

from rig import calibration
from rig.ownership import FOLDER_VARIABLE

settings.register_profile("fixed", derandomize=True)
settings.load_profile("fixed")
os.environ[FOLDER_VARIABLE] = tempfile.mkdtemp(prefix="rig-ports-")
os.environ[calibration.FOLDER_VARIABLE] = os.path.join(os.environ[FOLDER_VARIABLE], "no calibrations")
