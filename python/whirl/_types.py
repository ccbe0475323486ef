"""Types that the stubs name."""
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Trajectories = ArrayLike  # samples x states, or a list of such
Frame = Any  # pandas.DataFrame, where pandas is installed
Axes = Any  # of matplotlib
