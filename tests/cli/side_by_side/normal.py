"""Leaving out what only tells two worlds apart: addresses, times, the nodes that ROS 1 adds."""

from __future__ import annotations

import re
import socket

from .worlds import Outcome

__all__ = ("normal",)

_HOST = re.escape(socket.gethostname())

# The master's log node, its parameters, and the services that every node of ROS 1 has.
_OWN = re.compile(
    r"""^(?:
        [ ]\*[ ]/rosout(?:_agg)?[ ]\[.*
      | /rosout(?:_agg)?
      | (?:[ ]\*[ ])?/[^/]+/(?:get_loggers|set_logger_level)(?:[ ]/.*)?
      | (?:<place>[ ]\t|[ ]\*[ ])/rosout
      | pinging[ ]/rosout[ ].*\n.*
      | /(?:rosdistro|rosversion|run_id|roslaunch/.*)
      | (?:[ ]\*[ ])?/[^/]+/(?:describe|get|list|set)_parameter(?:s|_types|s_atomically)(?:[ ]/.*)?
      | (?:[ ]\*[ ])?/[^/]+/get_type_description(?:[ ]/.*)?
    )\n""",
    re.MULTILINE | re.VERBOSE,
)
_PLACES = (
    (re.compile(r"http://127\.0\.0\.1:\d+/(?:node/\w+/)?"), "<place>"),
    (re.compile(rf"{_HOST}, pid \d+"), "<place>"),
    (re.compile(rf"^(?:127\.0\.0\.1|{_HOST})$", re.MULTILINE), "<host>"),
    (re.compile(r"rosrpc://127\.0\.0\.1:\d+"), "<uri>"),
    (re.compile(r"\b\d+/\S+/RIHS01_\w+"), "<uri>"),
)
_VALUES = (
    (re.compile(r"xmlrpc reply from"), "reply from"),
    (re.compile(r"time=[\d.]+ms"), "time=<t>"),
    (re.compile(r"^Pid: \d+", re.MULTILINE), "Pid: <pid>"),
    (re.compile(r"outbound \(\d+ - [\d.]+:\d+\) \[\d+\]"), "outbound <socket>"),
    (re.compile(r"seq: \d+"), "seq: <n>"),
    (re.compile(r"^(\d+),\d+,(?=\d+,)", re.MULTILINE), r"\1,<n>,"),
    (re.compile(r"^\d{19}(?=,)", re.MULTILINE), "<now>"),
)
_FIGURES = re.compile(r"\d[\d.]*(?:K?B(?:/s)?)?")
_MEASURES = ("topic hz", "topic bw", "topic delay")


def normal(line: str, outcome: Outcome) -> Outcome:
    """Return what must be the same in both worlds.

    Args:
        line: The command.
        outcome: What came of it. Of talk on stderr only that there is some counts: rosz has its own
            words, which say more.
    """
    out = outcome.out
    for pattern, text in _PLACES:
        out = pattern.sub(text, out)
    out = _OWN.sub("", out)
    for pattern, text in _VALUES:
        out = pattern.sub(text, out)
    if line.startswith(_MEASURES):
        out = _FIGURES.sub("<x>", out)
    if line.startswith("node list -"):
        out = "".join(sorted(set(out.splitlines(keepends=True))))
    out = _sorted_lists(out)
    return Outcome(outcome.code, out.rstrip("\n"), "some" if outcome.err else "")


def _sorted_lists(text: str) -> str:
    """Return a text with the items of every list sorted, which ROS 1 leaves to chance."""
    lines: list[str] = []
    items: list[str] = []
    for line in [*text.split("\n"), ""]:
        if line.startswith((" * /", "pinging /")):
            items.append(line)
            continue
        if line.startswith("reply from") and items:
            continue
        lines += sorted(items)
        items.clear()
        lines.append(line)
    return "\n".join(lines)
