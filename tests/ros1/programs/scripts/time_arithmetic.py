#!/usr/bin/env python
"""Times and durations: making, adding, comparing, printing, and what cannot be done."""

import genpy
from rospy import Duration, Time

print([Time(1, 5), Duration(-1.5)])


def attempt(text):
    try:
        value = eval(text)
        print(text, "->", type(value).__name__, str(value) if isinstance(value, (Time, genpy.Duration)) else repr(value))
    except Exception as error:
        print(text, "->", type(error).__name__)


for text in """
Time()
Time(1)
Time(1.5)
Time(1, 500000000)
Time(0, 2500000000)
Time(5, -1)
Time(secs=3, nsecs=4)
Time.from_sec(1.25)
Time.from_seconds(1.25)
Time(-1)
Time(0, -1)
Time("1")
Time(1.5, 2)
Time(2).to_sec()
Time(2, 5).to_nsec()
Time(2, 5).to_time()
Time(1, 5).secs, Time(1, 5).nsecs
Time(1) + Duration(2)
Duration(2) + Time(1)
Time(1) + Time(2)
Time(1) + 1
Time(3) - Time(1)
Time(1) - Time(3)
Time(3) - Duration(1.5)
Time(1) - Duration(3)
Time(3) - 1
Duration(3) - Time(1)
Time(1) == Time(1, 0)
Time(1) == 1
Time(1) == Duration(1)
Time(1) < Time(1, 1)
Time(1) < 2
Time(1) < Duration(2)
Time(1) > Time(0.5), Time(1) >= Time(1), Time(1) <= Time(0), Time(1) != Time(2)
hash(Time(1)) == hash(Time(1, 0))
bool(Time()), bool(Time(1))
Time().is_zero(), Time(0, 1).is_zero()
Time(1).canon()
Duration()
Duration(1.5)
Duration(-1.5)
Duration(1, -500000000)
Duration(0, 3000000000)
Duration.from_sec(-0.25)
Duration(-1.5).secs, Duration(-1.5).nsecs
Duration(-1.5).to_sec()
Duration(-1.5).to_nsec()
Duration(1) + Duration(2.5)
Duration(1) - Duration(2.5)
Duration(1) + 1
-Duration(1.5)
abs(Duration(-1.5))
Duration(1.5) * 2
2 * Duration(1.5)
Duration(1.5) * 0.5
Duration(3) / 2
Duration(3) / 2.0
Duration(3) // 2
Duration(3) // 0.7
Duration(3) / Duration(2)
Duration(3) // Duration(2)
Duration(3) % Duration(2)
Duration(3) / 0
Duration(3) * "x"
divmod(Duration(7), Duration(2))
Duration(1) < Duration(2), Duration(1) == Duration(1.0)
Duration(1) < 2
Duration(1) == 1
Duration("x")
sorted([Time(3), Time(1), Time(2)])
max(Duration(1), Duration(2))
{Time(1): "a"}[Time(1, 0)]
Time(4294967295)
Time(4294967296)
Duration(2147483647)
Duration(2147483648)
Duration(-2147483649)
""".strip().splitlines():
    attempt(text)
