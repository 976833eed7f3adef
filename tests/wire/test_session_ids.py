from __future__ import annotations

import secrets

import pytest

from rosz.wire import FOREIGN_DIGITS, host_number, id_prefix, is_rosz_id


def test_an_id_tells_its_host() -> None:
    one, other = (id_prefix(host) + 22 * "0" for host in ("robot", "laptop"))
    assert is_rosz_id(one)
    assert is_rosz_id(other)
    assert host_number(one) != host_number(other)
    assert host_number(one) == host_number(id_prefix("robot") + 18 * "1" + "ffff")


@pytest.mark.parametrize("digit", FOREIGN_DIGITS)
def test_ids_of_others(digit: str) -> None:
    assert not is_rosz_id(id_prefix("robot") + 21 * "0" + digit)
    assert not is_rosz_id("abc")
    assert not any(is_rosz_id(secrets.token_hex(16)) for _ in range(100))
