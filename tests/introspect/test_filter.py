"""A filter is an expression, or refused with the reason."""

from __future__ import annotations

import pytest

from rosz.errors import RoszError, UsageError
from rosz.introspect.fields import Filter
from rosz.msgs.std_msgs.msg import Int32

REFUSED = {
    "m.data > > 3": "invalid syntax at column 10",
    "m\0": "null bytes",
    "m\udcff": "surrogates not allowed",
    "m" + ".x" * 100_000: "too deep",
    "-" * 100_000 + "m": "too deep",
}


@pytest.mark.parametrize(("text", "reason"), REFUSED.items(), ids=range(len(REFUSED)))
def test_what_is_no_expression(text: str, reason: str) -> None:
    with pytest.raises(UsageError, match="is not a Python expression: ") as caught:
        Filter(text)
    assert reason in str(caught.value)
    assert len(str(caught.value)) < 300


def test_messages_are_told_apart() -> None:
    chosen = Filter("m.data > 3 and topic == '/a'")
    assert chosen.accepts(Int32(4), "/a")
    assert not chosen.accepts(Int32(4), "/b")
    with pytest.raises(RoszError, match=r"filter .m\.x. failed: AttributeError"):
        Filter("m.x").accepts(Int32(4))
