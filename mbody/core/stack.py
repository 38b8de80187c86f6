"""A stack of numbers in the frame of a kernel: no allocation, and every thread has its own."""

from __future__ import annotations

from typing import Any

#: How many numbers it has.
FRAME_NUMBERS = 99


def numbers_in_frame(like: Any) -> Any:
    """`FRAME_NUMBERS` numbers of any value, of the type of another; in compiled code in the frame
    of the caller.
    """
    return [0.0] * FRAME_NUMBERS
