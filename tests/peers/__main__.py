"""Compares test suites of public ROS 1 packages on real ROS 1 (Debian) and on rosz.

    python -m tests.peers [--path ROOT]… [--only rosz|ros1] [--why] [--json FILE] FILE|FOLDER…

A FILE is a ``test_*.py`` (a file of unittest cases or of nose's functions) or a ``.test`` file of
rostest; a FOLDER stands for all such files below it, except nodes that a ``.test`` file starts.
Packages on which those of the files depend are searched below each ROOT: their messages are
generated with genpy for real ROS 1, and found on the package path by rosz.

For each file it prints how many tests pass on ROS 1, how many of those pass on rosz, and each one
that does not, with the last line of its error; ``--why`` prints the whole error. Tests of what is
internal to ROS 1's packages are listed in ``internal.py``, with the reason, and counted apart.
Nothing is fetched: check repositories out outside of this one. Debian's packages ``ros-base``,
``python3-rospy``, ``python3-rostest`` and the messages that tests use have to be installed.
``--work DIR`` keeps the generated modules for the next run, and the logs of all programs.

Example: ``python -m tests.peers --path ~/ros_comm/test ~/ros_comm/test/test_rospy/test/unit``
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from .internal import reason
from .sides import Outcome, Ros, Rosz, Side, package_of

_NODE = re.compile(r"\brosrun\(|\brostest\.(run|unitrun)\(")
_USAGE = "python -m tests.peers"


def main(argv: Sequence[str]) -> int:
    """Compare, and return 0 if everything public that passes on ROS 1 passes on rosz."""
    parser = argparse.ArgumentParser(prog=_USAGE, description=(__doc__ or "").split("\n")[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE|FOLDER")
    parser.add_argument("--path", action="append", default=[], type=Path, metavar="ROOT")
    parser.add_argument("--only", choices=("rosz", "ros1"))
    parser.add_argument("--why", action="store_true")
    parser.add_argument("--json", type=Path, metavar="FILE")
    parser.add_argument("--work", type=Path, metavar="DIR")
    parser.add_argument("--seconds", type=float, default=120, metavar="N")
    options = parser.parse_args(argv)
    files = [file.resolve() for given in options.files for file in _files(given)]
    given = (*map(package_of, files), *(path.resolve() for path in options.path))
    roots = list(dict.fromkeys(given))
    with tempfile.TemporaryDirectory() as temporary:
        work = (options.work or Path(temporary)).resolve()
        sides: list[Side] = []
        if options.only != "rosz":
            sides.append(Ros(roots, work / "ros1", options.seconds))
        if options.only != "ros1":
            sides.append(Rosz(roots, work / "rosz", options.seconds))
        found = {file: {side.name: side.run(file) for side in sides} for file in files}
    if options.json:
        names = {str(file): outcomes for file, outcomes in found.items()}
        options.json.write_text(json.dumps(names, indent=1))
    return _report(found, why=options.why)


def _files(given: Path) -> list[Path]:
    if given.is_file():
        return [given]
    units = (file for file in given.rglob("test_*.py") if not _NODE.search(file.read_text()))
    return sorted([*units, *given.rglob("*.test")])


def _report(found: dict[Path, dict[str, dict[str, Outcome]]], *, why: bool) -> int:
    totals = [0, 0, 0]
    for file, sides in found.items():
        expected = {
            name
            for name, (outcome, _) in sides.get("ROS 1", sides.get("rosz", {})).items()
            if outcome == "passed" or "ROS 1" not in sides
        }
        internal = {name for name in expected if reason(file, name)}
        public = expected - internal
        ours = sides.get("rosz", sides.get("ROS 1", {}))
        bad = sorted(name for name in public if ours.get(name, ("missing", ""))[0] != "passed")
        totals = [totals[0] + len(public), totals[1] + len(bad), totals[2] + len(internal)]
        print(f"{file.name}: {len(public) - len(bad)}/{len(public)}, internal {len(internal)}")
        for name in bad:
            outcome, text = ours.get(name, ("missing", _whole(ours)))
            last = text.strip().rpartition("\n")[2]
            print(f"    {outcome} {name}: {text if why else last[:200]}")
    print(f"public: {totals[0] - totals[1]} of {totals[0]} pass; internal: {totals[2]}")
    return 1 if totals[1] else 0


def _whole(outcomes: dict[str, Outcome]) -> str:
    return next((text for name, (_, text) in outcomes.items() if "whole file" in name), "")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
