"""Which examples do property tests look at, and where do tests lock ports?

The same examples every time: what passes here passes there. Every process of tests locks ports in a folder of its own:
devices emulated inside a test have one name in all of them.
"""

import os
import tempfile

from hypothesis import settings

from rig.ownership import FOLDER_VARIABLE

settings.register_profile("fixed", derandomize=True)
settings.load_profile("fixed")
os.environ[FOLDER_VARIABLE] = tempfile.mkdtemp(prefix="rig-ports-")
