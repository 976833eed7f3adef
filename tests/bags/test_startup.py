"""What is imported to show what is in a bag, and to record one."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from .ros1_files import STORE, write_bag

SLOW = ("numpy", "rosz.typestore", "yaml", "zenoh")
SHOW = f"""
import sys
from rosz.cli.main import run
code = run(["bag", "info", sys.argv[1]])
print([one for one in {SLOW!r} if one in sys.modules])
sys.exit(code)
"""


def test_info_imports_nothing_slow(tmp_path: Path) -> None:
    string = STORE.types["std_msgs/msg/String"]
    bag = write_bag(tmp_path / "x.bag", [("/chatter", 10, string(data="a"))])
    command = [sys.executable, "-c", SHOW, str(bag)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert "/chatter" in done.stdout
    assert done.stdout.splitlines()[-1] == "[]"


def test_recorder_of_mcap_imports_no_other_format() -> None:
    ours = ("rosz.msgs.rcl_interfaces.srv", "rosz.bags.formats.ros1_reader")
    large = ("_hashlib", "importlib.abc", "sqlite3", "yaml", *ours)
    script = f"""
import sys
import rosz.bags.record.parameters, rosz.bags.record.recorder, rosz.bags.record.recording
import rosz.cli.bag.record
import rosz.bags.formats.mcap_writer, rosz.typestore
print([one for one in {large!r} if one in sys.modules])
"""
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout == "[]\n"
