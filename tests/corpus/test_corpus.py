"""The comparing programs over a checkout of our own, with what public packages commonly do."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from oracle import require

sys.path.insert(0, str(Path(__file__).parents[1] / "launch"))

from corpus import definitions, launch  # found by the line above
from corpus.devel import Devel
from corpus.nodes import Nodes, differences
from corpus.packages import Corpus

pytestmark = pytest.mark.ros1

_CHECKOUT = Path(__file__).with_name("checkout")


@pytest.fixture(scope="module")
def corpus() -> Corpus:
    return Corpus([_CHECKOUT])


def test_launch_files_are_read_as_roslaunch_reads_them(corpus: Corpus) -> None:
    rows = list(launch.compare(corpus, corpus.repositories, 1))
    assert [row["differences"] for row in rows] == [[]]


def test_types_have_the_md5_of_genpy(corpus: Corpus, tmp_path: Path) -> None:
    require("genpy", "rospy", package="python3-genpy, python3-rospy")
    rows = list(definitions.compare(corpus, Devel(corpus, tmp_path), corpus.repositories))
    assert {row["case"] for row in rows if row["equal"] and "error" not in row["rosz"]} == {
        "checkout:msg field_msgs/Track",
        "checkout:srv field_msgs/Select",
    }


@pytest.fixture
def open_folder() -> Iterator[Path]:
    """Return a folder that the user of the nodes can read, which pytest's own folders deny."""
    with tempfile.TemporaryDirectory(prefix="rosz-corpus-") as folder:
        Path(folder).chmod(0o755)
        yield Path(folder)


@pytest.mark.system
def test_nodes_start_register_and_end_as_on_rospy(corpus: Corpus, open_folder: Path) -> None:
    modules = ("rospy", "tf", "actionlib", "diagnostic_updater", "message_filters", "catkin_pkg")
    require(*modules, package="python3-rospy, python3-tf, python3-diagnostic-updater, catkin …")
    if os.geteuid() != 0 or shutil.which("unshare") is None:
        pytest.skip("needs root and unshare, for namespaces")
    devel = Devel(corpus, open_folder / "devel")
    (open_folder / "devel").mkdir()
    devel.build(corpus.repositories)
    rows = list(Nodes(corpus, devel, open_folder, 9).compare(corpus.repositories, [], 4))
    found = {row["case"].rpartition("/")[2]: row["ros1"]["outcome"] for row in rows}
    assert found == {
        "tracker.py": ["ran"],
        "worker.py": ["ran"],
        "unset.py": ["raised", "KeyError", "unset.py:5"],
        "lacking.py": ["raised", "ModuleNotFoundError a_module_that_nobody_has", "lacking.py:3"],
    }
    assert [differences(row["rosz"], row["ros1"]) for row in rows] == [[]] * 4
