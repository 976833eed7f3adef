"""Revoked keys: refused by running cores, on live links too; other keys go on."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from hosts.host import Host, HostProgram
from hosts.world import World
from network import eventually

from rosz.errors import UsageError
from rosz.security import Authority, review_keys
from rosz.security import authority as authority_module

ROBOT = """
    import rosz
    from rosz.msgs.std_msgs.msg import String
    with rosz.Node("robot") as node:
        node.params.set("/pin", "vault-4711")
        node.subscription("cmd_vel", String, lambda m: print("got", m.data, flush=True))
        odom = node.publisher("odom", String)
        print("up", flush=True)
        for tick in node.rate(20):
            odom.publish(str(tick))
"""
STOLEN = """
    import sys
    import rosz
    from rosz.msgs.std_msgs.msg import String
    with rosz.Node("stolen") as node:
        out = node.publisher("cmd_vel", String)
        hear = node.subscription("odom", String)
        hear.get(timeout=60)
        print("heard odom", flush=True)
        for order in sys.stdin:
            out.publish(order.strip())
            view = node.context.graph.view()
            print("sees", *sorted(view.nodes()), flush=True)
"""
AFRESH = "have changed: started afresh, with "


class Fleet:
    """A robot with a core, a desk, and a laptop that is stolen; all have keys and dial the robot.

    Args:
        world: The world of the hosts.
        authority: The authority of their keys.
    """

    def __init__(self, world: World, authority: Authority) -> None:
        self.authority = authority
        self.robot, self.desk, self.laptop = world.hosts("robot", "desk", "laptop")
        for host in (self.robot, self.desk, self.laptop):
            authority.add(host.name, [host.address])
            host.variables["ROSZ_KEYS"] = str(authority.folder)
        for host in (self.desk, self.laptop):
            host.variables["ROSZ_CONNECT"] = "tcp/robot:7447"
        # Whoever stole it keeps the keys.
        copy = shutil.copytree(authority.folder / "laptop", world.folder / "stolen")
        self.laptop.variables["ROSZ_KEYS"] = str(copy)

    def start(self) -> tuple[HostProgram, HostProgram]:
        core = self.robot.rosz("core", "--listen", f"tcp/{self.robot.address}:7447")
        core.wait_for("started core")
        robot = self.robot.program(ROBOT)
        robot.wait_for("up")
        return core, robot

    @staticmethod
    def sees_robot(host: Host) -> bool:
        listing = host.rosz("topic", "list")
        return listing.exit_code() == 0 and "/odom" in listing.output

    def will_see_robot(self, host: Host) -> None:
        """Wait until a host sees the robot's node, which links to its core anew."""
        eventually(lambda: self.sees_robot(host), f"the robot at {host.name}")


@pytest.fixture
def fleet(world: World, authority: Authority) -> Fleet:
    return Fleet(world, authority)


def test_a_live_link_ends_and_no_other_comes(fleet: Fleet) -> None:
    core, robot = fleet.start()
    stolen = fleet.laptop.program(STOLEN)
    stolen.wait_for("heard odom")
    stolen.say("before")
    robot.wait_for("got before")
    assert fleet.sees_robot(fleet.desk)
    fleet.authority.revoke("laptop")
    core.wait_for(AFRESH)
    core.wait_for("WARNING: a link is refused: its keys were revoked")
    stolen.say("after")
    assert "robot" not in stolen.wait_for("sees", times=2)
    listing = fleet.laptop.rosz("topic", "list")
    assert listing.exit_code() == 1
    assert "the keys of this machine may have been revoked" in listing.output
    fleet.will_see_robot(fleet.desk)
    assert fleet.robot.ask("param", "get", "/pin") == "vault-4711"
    fleet.authority.add("laptop", [fleet.laptop.address])
    fleet.laptop.variables["ROSZ_KEYS"] = str(fleet.authority.folder)
    fleet.will_see_robot(fleet.laptop)
    assert "got after" not in robot.output


def test_a_revoked_machine_is_not_dialled_either(fleet: Fleet) -> None:
    keys = fleet.laptop.variables["ROSZ_KEYS"]
    server = fleet.laptop.rosz("core", "--listen", "tcp/0.0.0.0:7447", ROSZ_CONNECT="")
    server.wait_for("started core")
    dialling = {"ROSZ_CONNECT": "tcp/laptop:7447"}
    assert fleet.desk.rosz("topic", "list", **dialling).exit_code() == 0
    fleet.authority.revoke("laptop")
    refused = fleet.desk.rosz("topic", "list", **dialling)
    assert refused.exit_code() == 1
    assert "(its keys were revoked)" in refused.output
    assert Path(keys, "key.pem").exists()


def test_a_file_that_is_not_whole_changes_nothing(fleet: Fleet) -> None:
    core, _ = fleet.start()
    file = fleet.authority.folder / "robot" / "authority.pem"
    whole = file.read_bytes()
    file.write_bytes(whole[:200])
    core.wait_for("changed keys or rules are not used: ")
    assert fleet.sees_robot(fleet.laptop)
    fleet.authority.revoke("laptop")
    core.wait_for(AFRESH)
    assert not fleet.sees_robot(fleet.laptop)


def test_rules_are_read_anew(fleet: Fleet) -> None:
    core, _ = fleet.start()
    assert fleet.sees_robot(fleet.desk)
    (fleet.authority.folder / "robot" / "rules.yaml").write_text("laptop: all\n")
    core.wait_for(AFRESH)
    fleet.will_see_robot(fleet.laptop)
    assert not fleet.sees_robot(fleet.desk)


def test_whom_an_authority_revokes(authority: Authority) -> None:
    for name in ("robot", "desk"):
        authority.add(name)
    gone = authority.revoke("robot")
    assert gone.parent == authority.folder / "revoked"
    assert (gone / "key.pem").is_file()
    authority.add("robot")
    authority.revoke("robot")
    again = Authority(authority.folder)
    assert len(authority_module.excluded_names(again.certificate)) == 2
    desk = (authority.folder / "desk" / "authority.pem").read_bytes()
    assert desk == (authority.folder / "authority" / "certificate.pem").read_bytes()
    assert [holder.name for holder in review_keys(authority.folder).holders] == ["desk"]
    for name in ("robt", "authority", "../desk"):
        with pytest.raises(UsageError, match=f"'{name}' has no keys in "):
            authority.revoke(name)


def test_keys_of_an_older_rosz_are_revoked_by_name(
    authority: Authority, monkeypatch: pytest.MonkeyPatch
) -> None:
    authority.add("robot")
    monkeypatch.setattr(authority_module, "own_name", lambda _: "")
    authority.revoke("robot")
    with pytest.raises(UsageError, match="'robot' was revoked as a name"):
        authority.add("robot2", ["robot"])
