"""diagnostic_analysis.sparse: CSV files with fewer rows."""

from __future__ import annotations

import csv
import os
import sys
from pathlib import Path

__all__ = ("csv", "make_sparse_length", "make_sparse_skip", "os", "sys")


def make_sparse_skip(csv_file: str, skip: int) -> str:
    """Write the first of every ``skip`` rows to a file beside; return its path."""
    return _write(csv_file, "_sparse.csv", skip)


def make_sparse_length(csv_file: str, length: int) -> str:
    """Write about ``length`` rows, evenly, to a file beside; return its path."""
    lines = len(Path(csv_file).read_text().split("\n"))
    return _write(csv_file, "_sprs_len.csv", max(lines // length, 1))


def _write(csv_file: str, ending: str, skip: int) -> str:
    output = csv_file.removesuffix(".csv") + ending
    with Path(csv_file).open(newline="") as source, Path(output).open("w", newline="") as target:
        csv.writer(target).writerows(
            row for at, row in enumerate(csv.reader(source)) if at % skip == 0
        )
    return output
