"""Compare what rosz.idl makes of the definitions with the plain reading, and with real ROS 1."""

import re

import pytest
from oracle import MESSAGES

from rosz.idl import (
    Catalog,
    Definition,
    message_hash,
    message_md5,
    parse_action,
    service_hash,
    service_md5,
)

from .fingerprints import FILES, type_hash


def find(name: str) -> Definition:
    return Definition(FILES[name].text, str(FILES[name].path))


def named(kind: str) -> list[str]:
    return [name for name, item in FILES.items() if item.kind == kind]


def installed() -> dict[str, str]:
    """Return the MD5 sums of the installed ROS 1 types of which there is a definition here."""
    found = {}
    for name in (*named("msg"), *named("srv")):
        package, kind, base = name.split("/")
        module = MESSAGES / package / kind / f"_{base}.py"
        if module.exists():
            # A service's own class follows those of its request and response.
            sums = re.findall(r"^ +_md5sum = ['\"](\w+)", module.read_text("utf-8"), re.MULTILINE)
            found[name] = sums[-1]
    return found


CATALOG = Catalog(find)
INSTALLED = installed()


@pytest.mark.parametrize("name", named("msg"))
def test_message_has_the_hash_that_the_rules_give(name: str) -> None:
    assert message_hash(CATALOG.message(name), CATALOG) == f"RIHS01_{type_hash(name)}"


@pytest.mark.parametrize("name", named("srv"))
def test_service_has_the_hash_that_the_rules_give(name: str) -> None:
    assert service_hash(CATALOG.service(name), CATALOG) == f"RIHS01_{type_hash(name)}"


@pytest.mark.parametrize("name", named("action"))
def test_action_has_the_fields_of_the_file(name: str) -> None:
    spec = parse_action(name, FILES[name].text)
    parts = [[field.name for field in part.fields] for part in (spec.goal, spec.result)]
    parts.append([field.name for field in spec.feedback.fields])
    assert parts == [[field.name for field in part.fields] for part in FILES[name].sections]


@pytest.mark.ros1
@pytest.mark.skipif(not INSTALLED, reason="ROS 1's message packages are not installed")
def test_installed_ros_1_types_have_the_md5sum_of_ros_1() -> None:
    ours = {
        name: message_md5(CATALOG.message(name), CATALOG)
        if FILES[name].kind == "msg"
        else service_md5(CATALOG.service(name), CATALOG)
        for name in INSTALLED
    }
    assert ours == INSTALLED
