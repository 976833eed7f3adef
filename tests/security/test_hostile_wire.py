"""A plain Zenoh client that sends only damaged data: no crash, no growth, a short log."""

from __future__ import annotations

import random
import struct
from collections.abc import Callable
from typing import Any

import msgspec
from interop.plain import Plain, plain_session
from network import TIMEOUT, Network, Program, repeats

from rosz.msgs.geometry_msgs.msg import Twist
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import SetBool
from rosz.params.wire import Batch, ClientRequest, add_header, encode
from rosz.wire import dds_type

VICTIM = """
    import resource, sys
    import rosz
    from rosz.msgs.geometry_msgs.msg import Twist
    from rosz.msgs.std_msgs.msg import String
    from rosz.msgs.std_srvs.srv import SetBool

    def memory():
        with open("/proc/self/statm") as file:
            pages = int(file.read().split()[1])
        return pages * resource.getpagesize() // 1_000_000

    with rosz.Node("victim") as node:
        node.subscription("twist", Twist, lambda message: None)
        node.subscription("chatter", String, lambda m: m.data == "still" and print("still here"))
        node.service("flip", SetBool, lambda request: (request.data, "flipped"))
        node.params.set("/a/b", 1)
        node.params.watch("/", lambda change: None)
        session = node.context.session.zid
        print("up", session, node.node_id)
        for line in sys.stdin:
            print("memory", memory(), node.params.get("/a/b"), len(node.params.names()))
"""
COUNT = repeats(40_000, 100_000)
MOST_LINES = 100
MOST_GROWTH_MB = COUNT // 2500
"""In the second half. Zenoh itself keeps two thirds of it, for each key that a token ever had."""


class Attacker:
    """Damages valid data, in the same way for the same seed."""

    def __init__(self, plain: Plain, zid: str, node_id: str) -> None:
        self._plain = plain
        self._random = random.Random(20)  # to be the same each time
        self._sound = struct.pack("<qqB16s", 1, 2, 16, bytes(16))
        self._zid = zid
        self._node_id = node_id
        self._acts: list[Callable[[], None]] = [
            self._sample,
            self._attachment,
            self._request,
            self._write,
            self._store,
            self._stray,
            self._token,
        ]

    def act(self) -> None:
        self._random.choice(self._acts)()

    def _damaged(self, data: bytes) -> bytes:
        """Return data with some bytes changed, removed, repeated or inserted."""
        changed = bytearray(data)
        for _ in range(self._random.randrange(1, 4)):
            place = self._random.randrange(len(changed) + 1)
            match self._random.randrange(4):
                case 0:
                    del changed[place:]
                case 1:
                    changed[place : place + 1] = self._random.randbytes(1)
                case 2:
                    changed[place:place] = self._random.randbytes(self._random.randrange(9))
                case _:
                    changed[place : place + 4] = b"\xff\xff\xff\xff"
        return bytes(changed)

    def _key(self, name: str, kind: Any) -> str:
        return f"42/{name}/{dds_type(kind._type_name)}/{kind._type_hash}"

    def _sample(self) -> None:
        name, message = self._random.choice([("twist", Twist()), ("chatter", String("hello"))])
        payload = self._damaged(message.to_cdr())
        self._put(self._key(name, type(message)), payload, self._sound)

    def _attachment(self) -> None:
        payload = String("hello").to_cdr()
        self._put(self._key("chatter", String), payload, self._damaged(self._sound))

    def _request(self) -> None:
        payload = self._damaged(SetBool.Request(True).to_cdr())
        self._ask(self._key("flip", SetBool), payload)

    def _batch(self) -> Batch:
        return Batch.of((self._random.getrandbits(62), "ab"), "x", [(("n", "m"), 1)])

    def _write(self) -> None:
        sealed = add_header("abcdef", self._random.randrange(1 << 60), encode(self._batch()))
        self._put("@rosz/42/change", self._damaged(sealed), None)

    def _store(self) -> None:
        verb = self._random.choice(["get", "names", "search", "stamp", "write", "dance"])
        question = encode(ClientRequest(verb, "/a", batch=self._batch()))
        where = self._random.choice(["ask", "set", "sync", "write"])
        self._ask(f"@rosz/42/store/{self._zid}/{where}", self._damaged(question))

    def _stray(self) -> None:
        payload = self._random.randbytes(self._random.randrange(64))
        space = self._random.choice(["ack", "inbox"])
        self._put(f"@rosz/42/{space}/{self._zid}/{self._random.randrange(9)}", payload, None)
        action = msgspec.msgpack.encode({"action": "dance", "name": "x"})
        self._ask(f"@rosz/42/control/{self._zid}/{self._node_id}", self._damaged(action))

    def _token(self) -> None:
        zid = self._random.randrange(1 << 20)
        chunks = ["@ros2_lv", "42", f"{zid:x}", "1", "2", "MP", "%", "%", "n", "%t", "T", "H", "::"]
        chunks[self._random.randrange(2, len(chunks))] = self._random.choice("x9%:")
        token = self._plain.session.liveliness().declare_token("/".join(chunks))
        token.undeclare()  # type: ignore[no-untyped-call]

    def _put(self, key: str, payload: bytes, attachment: bytes | None) -> None:
        self._plain.session.put(key, payload, attachment=attachment)

    def _ask(self, key: str, payload: bytes) -> None:
        self._plain.session.get(key, lambda _: None, payload=payload, timeout=1.0)


def memory(victim: Program) -> int:
    """Return the memory of the victim in megabytes; it must still have its parameter."""
    before = victim.output.count("memory ")
    victim.say("")
    victim.wait_for("memory ", 4 * TIMEOUT, times=before + 1)
    said = [line for line in victim.output.splitlines() if line.startswith("memory ")]
    _, megabytes, value, _ = said[-1].split()
    assert value == "1"
    return int(megabytes)


def test_only_damaged_data(network: Network) -> None:
    victim = network.program(VICTIM)
    _, zid, node_id = victim.wait_for("up").split()
    with plain_session(network.rendezvous) as plain:
        attacker = Attacker(plain, zid, node_id)
        for _ in range(COUNT // 2):
            attacker.act()
        midway = memory(victim)
        for _ in range(COUNT // 2):
            attacker.act()
        grown = memory(victim) - midway
        print(f"{COUNT} damaged messages: grown by {grown} MB from {midway} MB")
        assert grown < MOST_GROWTH_MB
        hello = String("still").to_cdr()
        plain.put(f"42/chatter/{dds_type(String._type_name)}/{String._type_hash}", hello)
        victim.wait_for("still here")
    assert len(victim.lines) < MOST_LINES, victim.output
    assert "Traceback" not in victim.output
