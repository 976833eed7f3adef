"""Private parameters given on the command line, ``_name:=value``."""

from __future__ import annotations

import pytest
from network import Network

from rosz.errors import UsageError


def test_values_are_yaml(network: Network) -> None:
    argv = ["_rate:=5", "_names:=[a, b]", "_none:=", "_text:='1'"]
    node = network.node(argv=argv)
    assert {name: node.params.get(f"~{name}") for name in ("rate", "names", "text")} == {
        "rate": 5,
        "names": ["a", "b"],
        "text": "1",
    }
    assert not node.params.has("~none")


@pytest.mark.parametrize(
    ("value", "reason"),
    [("2020-13-45", "month must be in 1..12"), ("[" * 20_000, "nested more than 100 deep")],
    ids=["date", "deep"],
)
def test_what_is_no_value(network: Network, value: str, reason: str) -> None:
    with pytest.raises(UsageError, match=f"is not a YAML value: .*{reason}"):
        network.node(argv=[f"_a:={value}"])
