"""Hold the definitions to fingerprints that ROS 2 and ROS 1 give types of these names."""

from pathlib import Path

import pytest

from .fingerprints import FILES, TYPES, md5sum, type_hash


def pins(file: str) -> list[tuple[str, str]]:
    lines = Path(__file__).with_name(file).read_text("utf-8").splitlines()
    return [(name, value) for name, value in (line.split() for line in lines if line[0] != "#")]


TYPE_HASHES = pins("type_hashes.txt")
MD5SUMS = pins("md5sums.txt")


@pytest.mark.parametrize(("name", "expected"), TYPE_HASHES)
def test_type_hash_is_that_of_ros_2(name: str, expected: str) -> None:
    assert type_hash(name) == expected


@pytest.mark.parametrize(("name", "expected"), MD5SUMS)
def test_md5sum_is_that_of_ros_1(name: str, expected: str) -> None:
    assert md5sum(name) == expected


def test_every_type_has_a_hash_of_its_own() -> None:
    assert len({type_hash(name) for name in TYPES}) == len(TYPES)


def test_pins_are_there_for_each_package_with_services() -> None:
    services = {item.package for item in FILES.values() if item.kind == "srv"}
    pinned = {name.split("/")[0] for name, _ in TYPE_HASHES + MD5SUMS if "/srv/" in name}
    assert services == pinned
