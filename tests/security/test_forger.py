"""An attacker with a key, few permissions, and a plain Zenoh client instead of rosz."""

from __future__ import annotations

import pytest
from hosts.host import Host, HostProgram
from network import TIMEOUT, eventually

from rosz.security import Authority

from .test_links import ROBOT

FORGER = """
    import json, struct, sys, threading, time
    import zenoh
    from rosz.msgs.std_msgs.msg import String
    from rosz.msgs.std_srvs.srv import Trigger
    from rosz.params.wire import (
        Batch, ClientRequest, Record, SyncReply, SyncRequest, add_header, encode)
    from rosz.wire import dds_type

    keys = sys.argv[1]
    config = zenoh.Config()
    for name, value in {
        "mode": "client",
        "connect/endpoints": ["tls/robot:7447"],
        "scouting/multicast/enabled": False,
        "timestamping/enabled": True,
        "transport/link/tls/root_ca_certificate": f"{keys}/authority.pem",
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/connect_certificate": f"{keys}/certificate.pem",
        "transport/link/tls/connect_private_key": f"{keys}/key.pem",
    }.items():
        config.insert_json5(name, json.dumps(value))
    session = zenoh.open(config)
    kept, others = [], zenoh.Locality.REMOTE

    def told(sample):
        print("saw", sample.key_expr, flush=True)

    for key in ("**", "0/**", "*/camera/**", "*/plan/**", "**/@adv/**", "@rosz/**", "@/**"):
        kept.append(session.declare_subscriber(key, told, allowed_origin=others))
        kept.append(session.liveliness().declare_subscriber(key, told, history=True))
    kept.append(session.declare_subscriber("0/odom/*/*", lambda _: print("odom", flush=True)))

    def ask(key, payload=None):
        how = {"timeout": 3, "target": zenoh.QueryTarget.ALL, "allowed_destination": others}
        for reply in session.get(key, payload=payload, **how):
            if reply.ok:
                print("answer", reply.ok.key_expr, bytes(reply.ok.payload), flush=True)

    def batch(path, value):
        return Batch.of((time.time_ns(), "f0"), "forger", [(tuple(path.split("/")), value)])

    string = f"{dds_type(String._type_name)}/{String._type_hash}"
    trigger = f"{dds_type(Trigger._type_name)}/{Trigger._type_hash}"
    hello, sound = String("forged").to_cdr(), struct.pack("<qqB16s", 1, 2, 16, bytes(16))
    zid = session.zid()
    token = session.liveliness().declare_token

    def records():
        return [Record("secrets/pin", time.time_ns(), "f0", "forger", [0])]

    def confused(query):
        query.reply(query.key_expr, encode(SyncReply(records=records())))

    print("up", flush=True)
    for line in sys.stdin:
        kept.append(session.declare_queryable(f"@rosz/0/store/{zid}/**", confused))
        kept.append(session.declare_queryable("0/format/**", lambda query: print("got a call")))
        kept.append(token(f"@rosz/0/replica/{zid}/1/forger"))
        for key in (f"0/lift/{string}", "0/**", "**", "*/lift/**", f"*/*/{string}"):
            session.put(key, hello, attachment=sound)
            session.delete(key)
        for key in (f"0/format/{trigger}", "0/**", "**/format/**", "**", "@rosz/**", "@/**"):
            ask(key, b"")
        write = encode(batch("secrets/pin", 0))
        put = encode(ClientRequest("write", batch=batch("secrets/pin", 0), timeout=1.0))
        for reach in ("", "/gains", "/gains/p", "/*", "/**", "/secrets", "/gains/../secrets"):
            stores = ("store/*/write", "store/*/set", "store/*/sync")
            for key in ("change/*", "change", "param", *stores):
                session.put(f"@rosz/0/{key}{reach}", add_header(str(zid), 1, write))
                ask(f"@rosz/0/{key}{reach}", put)
                ask(f"@rosz/0/{key}{reach}", encode(SyncRequest(digest=b"", records=records())))
                ask(f"@rosz/0/{key}{reach}", add_header(str(zid), 1, write))
        session.put("@rosz/0/param/secrets/pin", b"\\x00")
        session.delete("@rosz/0/param/secrets")
        fair = add_header(str(zid), 2, encode(batch("gains/p", 77)))
        session.put("@rosz/0/change/*/gains", fair)
        print("done", flush=True)
"""


def start(robot: Host, authority: Authority, rules: str) -> HostProgram:
    (authority.folder / "robot/rules.yaml").write_text(rules)
    robot.rosz("core", "--listen", "tcp/0.0.0.0:7447").wait_for("started core")
    victim = robot.program(ROBOT)
    victim.wait_for("up")
    return victim


def test_a_plain_client_gets_no_further(pair: tuple[Host, Host], authority: Authority) -> None:
    robot, laptop = pair
    victim = start(robot, authority, "laptop: {subscribe: [/odom], set: ['/gains/**']}\n")
    forger = laptop.program(FORGER, laptop.variables["ROSZ_KEYS"])
    forger.wait_for("odom")
    forger.say("go")
    forger.wait_for("done", 4 * TIMEOUT)
    victim.wait_for("param /gains/p 77")
    assert robot.ask("param", "get", "/secrets/pin") == "vault-4711"
    got = [line for line in victim.lines if line.startswith(("got", "served", "param /secrets"))]
    assert got == []
    print(forger.output)
    for word in (
        "camera",
        "plan",
        "map",
        "lift",
        "format",
        "reset",
        "vault-4711",
        "got a call",
        "@/",
    ):
        assert word not in forger.output
    eventually(lambda: robot.lists("/robot"), "the node")


@pytest.mark.parametrize("control", [True, False])
def test_taking_over_a_node_needs_control(
    pair: tuple[Host, Host], authority: Authority, control: bool
) -> None:
    """A newer node of the same name ends the older one, so that needs permission to end nodes.

    Its age counts, which the older one asks it for: the clock of its machine is an hour behind.
    """
    robot, laptop = pair
    rules = f"laptop: {{subscribe: ['/**'], control: {str(control).lower()}}}\n"
    victim = start(robot, authority, rules)
    usurper = laptop.program(
        """
        import time
        now = time.time_ns
        time.time_ns = lambda: now() - 3600 * 10**9
        import rosz
        with rosz.Node("robot"), rosz.Node("witness") as node:
            node.spin()
        """,
        ROSZ_CONNECT="tcp/robot:7447",
    )
    eventually(lambda: robot.lists("/witness"), "the other machine's node")
    if control:
        victim.wait_for("new node registered with same name")
        victim.exit_code()
        return
    for _ in range(3):
        assert "/robot" in robot.ask("node", "list")
    assert victim.process.poll() is None
    assert "new node" not in victim.output
    assert usurper.process.poll() is None
