"""genpy.rostime against the real one: constructors, arithmetic, kinds."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import pytest
from oracle import same

from rosz.msgs.builtin_interfaces.msg import Duration, Time
from rosz.ros1 import install

install()
genpy: Any = import_module("genpy")


@pytest.mark.ros1
def test_times_are_those_of_genpy() -> None:
    same(
        """
        from genpy.rostime import Duration, TVal, Time
        def tell(make):
            try:
                made = make()
                if isinstance(made, TVal):
                    return [made.secs, made.nsecs, str(made)]
                return repr(made)
            except (TypeError, ValueError) as error:
                return type(error).__name__
        result = [
            [
                tell(lambda: kind()),
                tell(lambda: kind(0, 1500000000)),
                tell(lambda: kind(1, -1)),
                tell(lambda: kind(-2, 5)),
                tell(lambda: kind(6.75)),
                tell(lambda: kind(0.5, 0.5)),
                tell(lambda: kind(secs=3, nsecs=4)),
                tell(lambda: kind.from_sec(2.25)),
                tell(lambda: [kind(1) == other(1) for other in (TVal, Time, Duration)]),
                tell(lambda: [isinstance(kind(), other) for other in (TVal, Time, Duration)]),
                tell(lambda: kind(3) - Duration(1)),
                tell(lambda: kind(3) - Time(1)),
                tell(lambda: kind(3) + Duration(0.5)),
                tell(lambda: kind(9) / 2),
                tell(lambda: kind(9) // 2),
                tell(lambda: -kind(1)),
                tell(lambda: repr(kind(1, 5))),
            ]
            for kind in (TVal, Time, Duration)
        ]
        """,
        "genpy",
        "python3-genpy",
    )


def test_times_of_messages_are_times_of_genpy() -> None:
    assert isinstance(Time(), genpy.Time)
    assert isinstance(Duration(), genpy.Duration)
    assert isinstance(Time(), genpy.TVal)
    assert not isinstance(Time(), genpy.Duration)
