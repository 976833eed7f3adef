import re
from collections import Counter
from graphlib import TopologicalSorter
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from .definitions import DEFINITIONS, KINDS, ROOT, Definition

PACKAGES = sorted(path for path in ROOT.iterdir() if path.is_dir())
PROGRAMS = {
    ROOT / "rosapi" / "rosapi_node",
    ROOT / "tf2_web_republisher" / "tf2_web_republisher",
}
"""Programs of packages that are named like their interfaces."""
NAMES = {str(definition) for definition in DEFINITIONS}

# What the code that ROS 2 generates for a service or an action draws in beside its own fields.
IMPLIED = {
    "msg": set[str](),
    "srv": {"service_msgs"},
    "action": {"action_msgs", "builtin_interfaces", "service_msgs", "unique_identifier_msgs"},
}


def manifest(package: Path) -> ET.Element:
    return ET.fromstring((package / "package.xml").read_text("utf-8"))  # our own file


def dependencies(package: Path) -> list[str]:
    return [depend.text or "" for depend in manifest(package).findall("depend")]


@pytest.mark.parametrize("definition", DEFINITIONS, ids=str)
def test_file_is_well_kept(definition: Definition) -> None:
    lines = definition.text.splitlines()
    assert definition.path.suffix == f".{definition.kind}"
    assert re.fullmatch(r"[A-Za-z][A-Za-z0-9]*", definition.name)
    assert definition.text.isascii()
    assert definition.text.endswith("\n")
    assert not definition.text.endswith("\n\n")
    assert re.match(r"# \S.{10,}", lines[0]), "the first line says what the definition is for"
    assert all(line == line.rstrip() and "\t" not in line and len(line) <= 100 for line in lines)
    assert len(definition.sections) == KINDS[definition.kind]


@pytest.mark.parametrize("definition", DEFINITIONS, ids=str)
def test_fields_are_named_once_and_refer_to_what_exists(definition: Definition) -> None:
    for section in definition.sections:
        counts = Counter(field.name for field in section.fields)
        assert not [name for name, count in counts.items() if count > 1]
        assert all(re.fullmatch(r"[a-z]([a-z0-9_]*[a-z0-9])?", name) for name in counts)
    assert definition.references <= NAMES


@pytest.mark.parametrize("package", PACKAGES, ids=lambda path: path.name)
def test_manifest_describes_the_package(package: Path) -> None:
    root = manifest(package)
    maintainer = root.find("maintainer")
    assert root.tag == "package"
    assert root.get("format") == "3"
    assert root.findtext("name") == package.name
    assert re.fullmatch(r"\d+\.\d+\.\d+", root.findtext("version", ""))
    assert len(root.findtext("description", "")) > 20
    assert root.findtext("license")
    assert maintainer is not None
    assert (maintainer.get("email"), maintainer.text) == ("dev@rosz.invalid", "rosz developers")


@pytest.mark.parametrize("package", PACKAGES, ids=lambda path: path.name)
def test_manifest_names_exactly_the_packages_in_use(package: Path) -> None:
    used: set[str] = set()
    for definition in DEFINITIONS:
        if definition.package == package.name:
            used |= {reference.partition("/")[0] for reference in definition.references}
            used |= IMPLIED[definition.kind]
    assert dependencies(package) == sorted(used - {package.name})


def test_packages_depend_on_each_other_without_a_ring() -> None:
    order = TopologicalSorter({path.name: dependencies(path) for path in PACKAGES})
    assert set(order.static_order()) == {path.name for path in PACKAGES}


def test_folders_hold_nothing_else() -> None:
    files = {path for path in ROOT.rglob("*") if path.is_file()}
    expected = {definition.path for definition in DEFINITIONS}
    expected |= {package / "package.xml" for package in PACKAGES}
    expected |= PROGRAMS
    assert files == expected
    assert all(program.stat().st_mode & 0o111 for program in PROGRAMS)
    assert {definition.kind for definition in DEFINITIONS} == set(KINDS)
