"""Everything that can fail before a user does.

Processes of tests share few cores, so linear algebra has one thread in each. It reads that when it is loaded, which
nothing has done before this package is.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"
