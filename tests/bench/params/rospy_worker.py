"""A rospy node that reads and writes parameters, told how often on stdin."""

# mypy: ignore-errors
import json
import sys
import time

import rospy


def timed(call, count):  # noqa: ANN001, ANN201
    """Return the seconds that each of so many calls took."""
    taken = []
    for _ in range(count):
        begun = time.perf_counter()
        call()
        taken.append(time.perf_counter() - begun)
    return taken


rospy.init_node("bench", disable_signals=True)
CALLS = {
    "set": lambda: rospy.set_param("/bench/value", 1.5),
    "get": lambda: rospy.get_param("/bench/value"),
}
CALLS["set"]()
print(json.dumps("up"), flush=True)
for line in sys.stdin:
    name, count = json.loads(line)
    print(json.dumps(timed(CALLS[name], count)), flush=True)
