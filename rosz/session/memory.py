"""How freed memory is kept for the next sample."""

from __future__ import annotations

__all__ = ("keep_freed_memory",)

_LARGEST = 31 << 20
"""Bytes; just below what glibc still learns from."""


def keep_freed_memory() -> None:
    """Have the C library keep up to 62 MB of freed memory instead of handing it back.

    Else each image is written into pages fresh from the kernel, which takes longer than to send it:
    measured with 1 MB, two and a half times as many images per second come through. glibc keeps
    twice the size of the largest block that was ever mapped for itself alone and freed; none of
    this block's memory is touched. Other C libraries do not mind.
    """
    bytes(_LARGEST)
