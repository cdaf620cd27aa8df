"""Queries cut into blocks whose lengths are powers of two, so that few programs are compiled."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

SMALLEST = 64


def padded_blocks(rows: NDArray[np.float64], largest: int) -> Iterator[tuple[NDArray[np.float64], int]]:
    """Blocks of at most `largest` rows, each with its number of true rows; the last row fills up the rest."""
    largest = max(SMALLEST, 1 << (largest.bit_length() - 1))
    for start in range(0, len(rows), largest):
        block = rows[start : start + largest]
        length = max(SMALLEST, 1 << (len(block) - 1).bit_length())
        yield np.concatenate([block, np.repeat(block[-1:], length - len(block), axis=0)]), len(block)
