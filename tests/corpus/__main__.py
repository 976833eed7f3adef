"""The command; see the package."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

_TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(_TESTS), str(_TESTS / "launch")]

import oracle  # noqa: E402  # found by the line above

from corpus import definitions, launch  # noqa: E402
from corpus.devel import Devel  # noqa: E402
from corpus.nodes import Nodes  # noqa: E402
from corpus.packages import Corpus, Repository  # noqa: E402

_INSTALLED = (
    *("ros+actionlib", "ros+bond_core", "ros+catkin", "ros+common_msgs", "ros+dynamic_reconfigure"),
    *("ros+executive_smach", "ros+genmsg", "ros+genpy", "ros+geometry", "ros+geometry2", "ros+ros"),
    *("ros+std_msgs", "ros+xacro", "ros-perception+laser_geometry", "ros-perception+vision_opencv"),
    *("ros-visualization+interactive_markers", "eric-wieser+ros_numpy", "ros+diagnostics"),
)
"""Repositories in whose place rosz has its own modules and types."""


def options() -> Namespace:
    """Return what the command line says."""
    parser = ArgumentParser(prog="tests.corpus", description=__doc__)
    parser.add_argument("what", choices=("launch", "types", "nodes"))
    parser.add_argument("paths", nargs="+", type=Path, metavar="PATH", help="checkouts to compare")
    parser.add_argument("--beside", type=Path, help="folder with more checkouts, to depend on")
    parser.add_argument("--work", type=Path, required=True, help="folder of builds and results")
    parser.add_argument("--only", nargs="*", default=[], help="parts of the names of nodes")
    parser.add_argument("--limit", type=int, default=4, help="nodes or files of a repository")
    parser.add_argument("--jobs", type=int, default=4, help="nodes at a time")
    return parser.parse_args()


def compared(given: Namespace, corpus: Corpus, own: list[Repository]) -> Iterator[dict[str, Any]]:
    """Compare what the command line names."""
    if given.what == "launch":
        return launch.compare(corpus, own, given.limit)
    devel = Devel(corpus, given.work / "devel")
    if given.what == "types":
        return definitions.compare(corpus, devel, own)
    devel.build(corpus.repositories)
    return Nodes(corpus, devel, given.work, given.limit).compare(own, given.only, given.jobs)


def main() -> None:
    """Compare, print a table of repositories, and write a line of JSON for each case."""
    given = options()
    oracle.marked = True
    own = {path.resolve() for path in given.paths}
    beside = sorted(path.resolve() for path in given.beside.iterdir()) if given.beside else []
    corpus = Corpus([*sorted(own), *(path for path in beside if path not in own)], _INSTALLED)
    (given.work / "devel").mkdir(parents=True, exist_ok=True)
    rows = []
    with (given.work / f"{given.what}.jsonl").open("w") as file:
        for row in compared(given, corpus, [one for one in corpus.repositories if one.path in own]):
            rows.append(row)
            print(json.dumps(row), file=file, flush=True)
    aside = [row for row in rows if row.get("setup")]
    counted = [row for row in rows if not (row.get("python2") or row.get("setup"))]
    total = Counter(row["case"].split(":")[0] for row in counted)
    equal = Counter(row["case"].split(":")[0] for row in counted if row["equal"])
    for name, count in sorted(total.items()):
        print(f"{name:50} {equal[name]:5} of {count:5}")
    percent = 100 * equal.total() / max(total.total(), 1)
    print(f"{'all':50} {equal.total():5} of {total.total():5} ({percent:.1f} %)")
    old = len(rows) - len(counted) - len(aside)
    print(f"of {len(total)} repositories; left out: {old} are of Python 2, {len(aside)} as follows")
    for row in aside:
        print(f"set-up differs: {row['case']}: {row['setup']}")


if __name__ == "__main__":
    main()
