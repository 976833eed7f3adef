"""rosgraph.names and genmsg.names against the real ones."""

from __future__ import annotations

from textwrap import dedent

import pytest
from oracle import same

from rosz.ros1.tools.rosgraph import names, network

NAMES = ["", "/", "a", "/a", "/a/", "a/b", "/a/b", "~a", "~", "~/a", "a//b", "//", "1a", "a b",
         "a-b", "_a", "a/", "/a/b/", "é", "a~", None]  # fmt: skip
ONE = ("canonicalize_name", "is_legal_name", "is_legal_base_name", "is_legal_remap", "namespace",
       "make_global_ns")  # fmt: skip
ARGUMENTS = ["a:=b", "_a:=b", "__name:=x", "a:=", ":=b", "/a:=~b", "a:=b:=c", "x", "a:= b ", "1:=2"]


def same_names(snippet: str) -> None:
    head = "import rosgraph\nfrom rosgraph import names, network\n"
    same(head + dedent(snippet), "rosgraph", "python3-rosgraph")


@pytest.mark.ros1
@pytest.mark.parametrize("function", ONE)
def test_functions_of_one_argument(function: str) -> None:
    skipped = "[1:-1]" if function == "namespace" else ""
    same_names(f"""
        result = [tried(names.{function}, name) for name in {NAMES}{skipped} if name is not None]
        """)


@pytest.mark.ros1
@pytest.mark.parametrize("function", ["is_global", "is_private"])
def test_predicates(function: str) -> None:
    same_names(f"""
        result = [bool(names.{function}(name)) for name in {NAMES} if name is not None]
        """)


@pytest.mark.ros1
def test_join_and_resolve() -> None:
    same_names(f"""
        known = [name for name in {NAMES} if name is not None]
        result = [
            [tried(names.ns_join, n, name) for n in ["", "/", "/ns", "ns/", "~"] for name in known],
            [
                tried(names.resolve_name, name, node, {{"/ns/a": "/b", "/ns/node/a": "/c"}})
                for node in ["/node", "/ns/node"]
                for name in known
            ],
            [tried(names.script_resolve_name, "script", name) for name in known],
            [tried(names.make_caller_id, name) for name in known],
        ]
        """)


@pytest.mark.ros1
def test_command_lines() -> None:
    same_names(f"""
        result = [
            tried(names.load_mappings, [one]) for one in {ARGUMENTS}
        ] + [
            rosgraph.myargv(["prog", *{ARGUMENTS}]),
            names.get_ros_namespace({{"ROS_NAMESPACE": "ns"}}, []),
            names.get_ros_namespace({{"ROS_NAMESPACE": "ns"}}, ["__ns:=/other"]),
            names.get_ros_namespace({{}}, []),
            rosgraph.get_master_uri({{}}, ["__master:=http://x:1"]),
            rosgraph.get_master_uri({{"ROS_MASTER_URI": "http://y:2"}}, []),
            rosgraph.get_master_uri({{"ROS_MASTER_URI": ""}}, []),
            rosgraph.get_master_uri({{}}, []),
            tried(rosgraph.get_master_uri, {{}}, ["__master:="]),
            tried(rosgraph.get_master_uri, {{}}, ["__master:=http://x:=1"]),
        ]
        """)


def test_anonymous_names_are_legal() -> None:
    name = names.anonymous_name("talker")
    assert name != names.anonymous_name("talker")
    assert name.startswith("talker_")
    assert names.is_legal_base_name(name)


@pytest.mark.ros1
def test_names_of_resources() -> None:
    same(
        f"""
        from genmsg import names
        known = {NAMES}
        texts = [name for name in known if name is not None]
        result = [
            [tried(names.is_legal_resource_name, name) for name in known],
            [tried(names.is_legal_resource_base_name, name) for name in known],
            [tried(names.resource_name_base, name) for name in texts],
            [tried(names.resource_name_package, name) for name in texts],
            [tried(names.package_resource_name, name) for name in texts + ["a/b/c"]],
            names.resource_name("p", "T"),
            names.resource_name("p", "T", my_pkg="p"),
            names.normalize_package_context(" p// "),
        ]
        """,
        "genmsg",
        "python3-genmsg",
    )


@pytest.mark.ros1
def test_types_of_fields() -> None:
    same(
        """
        from genmsg import msgs
        types = ["a", "int8[]", "p/T[3]", "Header", "Header[]", "time", "a[", "a[x]", "a[1][2]", ""]
        def parsed(text):
            try:
                return msgs.parse_type(text)
            except ValueError as error:
                return str(error)
        result = [
            [parsed(text) for text in types],
            [msgs.bare_msg_type(text) for text in types],
            [msgs.resolve_type(text, "p") for text in types if text],
            [msgs.is_valid_msg_type(text) for text in types + ["a[1]b", "a b"]],
            [msgs.is_builtin(text) for text in types],
            [msgs.is_header_type(text) for text in types],
            [msgs.is_valid_constant_type(text) for text in types + ["string"]],
            sorted(msgs.BUILTIN_TYPES),
        ]
        """,
        "genmsg",
        "python3-genmsg",
    )


@pytest.mark.ros1
def test_addresses() -> None:
    assert network.get_local_addresses()
    assert network.is_local_address("127.0.0.1")
    assert network.get_local_address() in network.get_local_addresses()
    same_names("""
        result = [
            tried(network.parse_http_host_and_port, url)
            for url in ["http://a:1/", "http://a", "a:3"]
        ]
        """)
