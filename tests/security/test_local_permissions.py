"""Warnings about rules that forbid what a machine declares."""

from __future__ import annotations

from pathlib import Path

import pytest
from hosts.host import Host
from hosts.world import World

from rosz.security import Authority, KeyFolder, LocalPermissions, read_rules
from rosz.wire import Kind

RULES = """
laptop:
  publish: [/cmd_vel, "/joy/**"]
  subscribe: ["/cam*/raw", "/*/status"]
  call: ["/**"]
"*":
  subscribe: [/map]
"""

DECLARER = """
    import rosz
    from rosz.msgs.std_msgs.msg import String
    from rosz.msgs.std_srvs.srv import Trigger

    with rosz.Node("declarer") as node:
        for name in ("/cmd_vel", "/lift", "/lift"):
            node.publisher(name, String)
        node.subscription("/map", String, print)
        node.subscription("/plan", String, print)
        node.client("/reset", Trigger)
        node.service("/lamp", Trigger, print)
        print("up", flush=True)
        node.spin()
"""


def permissions(rules: str, host: str = "laptop", folder: str = "keys") -> LocalPermissions | None:
    file = Path("/etc/rules.yaml")
    keys = KeyFolder(Path("/home") / folder, read_rules(rules, str(file)), file)
    return LocalPermissions.find(keys, host)


@pytest.mark.parametrize(
    ("kind", "name", "allowed"),
    [
        (Kind.PUBLISHER, "/cmd_vel", True),
        (Kind.PUBLISHER, "/cmd_vel/fast", False),
        (Kind.PUBLISHER, "/joy", True),
        (Kind.PUBLISHER, "/joy/a/b", True),
        (Kind.PUBLISHER, "/joyful", False),
        (Kind.SUBSCRIPTION, "/cmd_vel", False),
        (Kind.SUBSCRIPTION, "/camera/raw", True),
        (Kind.SUBSCRIPTION, "/cam/raw", True),
        (Kind.SUBSCRIPTION, "/camera/x/raw", False),
        (Kind.SUBSCRIPTION, "/arm/status", True),
        (Kind.SUBSCRIPTION, "/status", False),
        (Kind.SUBSCRIPTION, "/map", True),
        (Kind.CLIENT, "/anything", True),
        (Kind.SERVICE, "/anything", False),
    ],
)
def test_what_is_allowed(kind: Kind, name: str, allowed: bool) -> None:
    found = permissions(RULES)
    assert found is not None
    text = found.describe_objection(kind, name)
    assert (text == "") == allowed
    if not allowed:
        assert f"'{name}'" in text
        assert "'/etc/rules.yaml' does not allow 'laptop'" in text
    assert found.describe_objection(kind, name) == ""  # told once


def test_which_rules_apply() -> None:
    assert permissions(RULES, "robot") is None  # rules for others
    assert permissions(RULES, "desk", "laptop") is not None  # keys of a person, on some host
    assert permissions("{}") is None
    assert LocalPermissions.find(None, "laptop") is None
    assert LocalPermissions.find(KeyFolder(Path("/home/keys"), None), "laptop") is None
    everything = permissions("laptop: all\n")
    assert everything is not None
    assert everything.describe_objection(Kind.SERVICE, "/a/b") == ""


def test_forbidden_declarations_are_logged(world: World, authority: Authority) -> None:
    robot, laptop = world.hosts("robot", "laptop")
    (authority.folder / "rules.yaml").write_text(f"{RULES}robot: all\n")
    for host in (robot, laptop):
        authority.add(host.name)
        host.variables["ROSZ_KEYS"] = str(authority.folder)
    robot.rosz("core", "--listen", "tcp/0.0.0.0:7447").wait_for("started core")
    laptop.variables["ROSZ_CONNECT"] = "tcp/robot:7447"
    quiet = _declarations(robot)
    assert quiet == []
    told = _declarations(laptop)
    named = [f"the {kind} of '{name}'" for kind, name in FORBIDDEN]
    assert [text for text in named if sum(text in line for line in told) == 1] == named
    assert len(told) == len(named)
    assert all(f"{authority.folder}/rules.yaml" in line and "'laptop'" in line for line in told)
    refused = laptop.rosz("topic", "pub", "-1", "/lift", "std_msgs/String", "data: hello")
    refused.wait_for("the publisher of '/lift' reaches no other machine", 60)


FORBIDDEN = [("publisher", "/lift"), ("subscription", "/plan"), ("service", "/lamp")]


def _declarations(host: Host) -> list[str]:
    program = host.program(DECLARER)
    program.wait_for("up", 60)
    return [line for line in program.lines if "reaches no other machine" in line]
