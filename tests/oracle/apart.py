"""Snippets that change rospy: both sides run in processes of their own, without a network."""

from __future__ import annotations

import json
import subprocess
import sys
from textwrap import dedent
from typing import Any

import oracle

__all__ = ("WITHOUT_NETWORK", "differences")

WITHOUT_NETWORK = """
import rospy
clock = [1000.0]
sent, subscribers, timers = [], [], []
class Publisher:
    def __init__(self, name, data_class, **options):
        self.name, self.options = name, sorted(options.items())
    def publish(self, message):
        sent.append((self.name, message))
    def unregister(self):
        pass
def subscribe(name, data_class, callback, **options):
    subscribers.append((name, callback, sorted(options.items())))
rospy.Time.now = classmethod(lambda cls: cls.from_sec(clock[0]))
rospy.get_name = lambda: "/node"
rospy.Publisher, rospy.Subscriber = Publisher, subscribe
def start_timer(period, callback, **options):
    timers.append((period.to_sec(), callback, options))
rospy.Timer = start_timer
rospy.get_param_cached = rospy.get_param = lambda name, default=None: default
logged = []
rospy.logwarn = lambda *words: logged.append("warning")
rospy.logerr = lambda *words: logged.append("error")
"""
"""What gives rospy a clock that stands, and publishers that only note what they publish."""


def differences(snippet: str, module: str, package: str) -> list[str]:
    """Return the places where the ``result`` of a snippet differs on both sides."""
    expected = oracle.real(snippet, module, package)
    end = "\nprint(json.dumps(plain(result)))"
    code = f"import rosz.ros1\n{oracle.HEAD}\n{dedent(snippet)}{end}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return list(_places(json.loads(done.stdout.splitlines()[-1]), expected, ""))


def _places(found: Any, expected: Any, place: str) -> list[str]:
    if isinstance(expected, dict) and isinstance(found, dict) and expected.keys() == found.keys():
        pairs = [(key, found[key], expected[key]) for key in expected]
    elif isinstance(expected, list) and isinstance(found, list) and len(expected) == len(found):
        pairs = [(str(at), found[at], expected[at]) for at in range(len(expected))]
    else:
        return [] if found == expected else [f"{place}: rosz {found}, real {expected}"]
    return [one for key, ours, real in pairs for one in _places(ours, real, f"{place}/{key}")]
