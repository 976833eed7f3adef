"""Random launch files, read by rosz and by real roslaunch."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import event, given, settings

from .launch_trees import Tree, launch_trees
from .roslaunch_oracle import Roslaunch, Rosz, differences

EXAMPLES = int(os.environ.get("ROSZ_LAUNCH_EXAMPLES", "25"))


@pytest.mark.parametrize("batch", range(6))
@settings(max_examples=EXAMPLES)
@given(tree=launch_trees())
def test_random_files_are_read_as_by_roslaunch(
    tree: Tree, tmp_path: Path, roslaunch: Roslaunch, rosz: Rosz, batch: int
) -> None:
    del batch  # each has other examples, and a time limit of its own
    file = tree.write(tmp_path)
    real = roslaunch.ask([file], tmp_path, tree.argv)
    event("refused" if real["error"] else "read")
    found = differences(rosz.ask([file], tmp_path, tree.argv), real)
    assert not found, "\n".join([*found, *tree.files.values()])
