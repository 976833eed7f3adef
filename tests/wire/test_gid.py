from __future__ import annotations

import random

import pytest

from rosz.wire import gid

T1 = "@ros2_lv/0/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener"

# Digests of n times 'a', one for each branch of the algorithm and its borders.
KNOWN = {
    17: "e1d69d5c23c0272dc5aa43e3c04977c7",
    128: "9dd9359e1b4c35ef05315f81912a4e13",
    129: "2f0af417a0573ad50fb2a009dd8b75a7",
    240: "390a763345d257ea06e2fdda1c726301",
    241: "3019ca5a5cefcff60b7bc0a2e4eb7b3e",
    1100: "b1476b87d25cef4c64e7e659a77e5c83",
}


@pytest.mark.parametrize(("size", "digest"), KNOWN.items())
def test_known_digests(size: int, digest: str) -> None:
    assert gid("a" * size).hex() == digest


def test_node_token() -> None:
    assert gid(T1).hex() == "5bd72f4daf53c0bb00c7394e7fc19547"


def test_equals_the_c_library() -> None:
    xxhash = pytest.importorskip("xxhash", reason="the C library of XXH3 is not installed")
    source = random.Random(1)
    for size in [*range(17, 500), 1023, 1024, 1025, 1088, 2048, 3000]:
        text = "".join(source.choices("abc/%@:09", k=size))
        assert gid(text) == xxhash.xxh3_128_digest(text.encode())[::-1], size
