"""The table of registrations: what comes, what goes, and what a newer node replaces."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rosz.bridges.ros1.registry import Change, Registry, RegistryEntry, Role


def _publisher(
    node: str, uri: str = "", name: str = "/t", kind: str = "std_msgs/String"
) -> RegistryEntry:
    return RegistryEntry("publisher", name, node, uri or f"http://{node[1:]}:1/", kind)


def test_registrations_come_and_go() -> None:
    registry, entry = Registry(), _publisher("/a")
    assert registry.register(entry) == [Change(entry, alive=True)]
    assert registry.register(entry) == []
    assert registry.uri("/a") == "http://a:1/"
    assert registry.by_name("publisher") == {"/t": ["/a"]}
    assert registry.unregister("publisher", "/t", "/a", "http://older:1/") == []
    assert registry.unregister("publisher", "/t", "/a", entry.uri) == [Change(entry, alive=False)]
    assert registry.unregister("publisher", "/t", "/a", entry.uri) == []
    assert (registry.nodes(), registry.types(), registry.dump()) == ({}, {}, [])


def test_a_newer_node_of_a_name_replaces_the_older() -> None:
    registry = Registry()
    older = [_publisher("/a", name="/t"), _publisher("/a", name="/u")]
    for entry in older:
        registry.register(entry)
    newer = _publisher("/a", "http://a:2/")
    changes = registry.register(newer)
    assert changes == [*(Change(e, alive=False) for e in older), Change(newer, alive=True)]
    assert registry.dump() == [newer]


def test_a_service_has_one_provider() -> None:
    registry = Registry()
    first = RegistryEntry("service", "/s", "/a", "http://a:1/", service_uri="rosrpc://a:9")
    second = RegistryEntry("service", "/s", "/b", "http://b:1/", service_uri="rosrpc://b:9")
    registry.register(first)
    changes = registry.register(second)
    assert changes == [Change(first, alive=False), Change(second, alive=True)]
    assert registry.unregister("service", "/s", "/a", "rosrpc://a:9") == []
    assert registry.unregister("service", "/s", "/b", "rosrpc://b:9")


def test_publishers_decide_the_type() -> None:
    registry = Registry()
    registry.register(RegistryEntry("subscriber", "/t", "/s", "http://s:1/", "*"))
    assert registry.types() == {}
    registry.register(RegistryEntry("subscriber", "/t", "/r", "http://r:1/", "a/B"))
    registry.register(RegistryEntry("subscriber", "/t", "/q", "http://q:1/", "a/C"))
    assert registry.types() == {"/t": "a/B"}
    registry.register(_publisher("/p", kind="a/D"))
    assert registry.types() == {"/t": "a/D"}


_ROLES: tuple[Role, ...] = ("publisher", "subscriber", "service", "param")
_STEPS = st.tuples(
    st.booleans(),
    st.sampled_from(_ROLES),
    st.sampled_from("ab"),
    st.sampled_from("xy"),
    st.integers(1, 2),
)


@given(st.lists(_STEPS, max_size=40))
def test_changes_tell_everything(steps: list[tuple[bool, Role, str, str, int]]) -> None:
    registry, seen = Registry(), set[RegistryEntry]()
    for add, role, name, node, uri in steps:
        entry = RegistryEntry(role, f"/{name}", f"/{node}", f"http://{node}:{uri}/")
        if add:
            changes = registry.register(entry)
        else:
            changes = registry.unregister(role, entry.name, entry.node, entry.uri)
        for change in changes:
            assert change.alive != (change.entry in seen)
            (seen.add if change.alive else seen.discard)(change.entry)
        assert seen == set(registry.dump())
        assert set(registry.nodes()) == {entry.node for entry in seen}
    again = Registry()
    for entry in registry.dump():
        again.register(entry)
    assert again.dump() == registry.dump()
