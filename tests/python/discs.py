"""Images to find curves in."""

import numpy as np


def two_discs(shape=(70, 90)):
    """Discs of radius 12 and 9 with a hole of 4 in the first: (image [row, column], centres x, y)."""
    y, x = np.mgrid[: shape[0], : shape[1]].astype(float)
    first, second = (28, 34), (64, 30)
    depth = np.maximum(12 - np.hypot(x - first[0], y - first[1]),
                       9 - np.hypot(x - second[0], y - second[1]))
    depth = np.minimum(depth, np.hypot(x - first[0], y - first[1]) - 4)
    return (50 + 150 / (1 + np.exp(-3 * depth))).astype(np.uint8), [(36, 34), second]
