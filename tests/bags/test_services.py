"""Recording the calls of services, whose types ROS 2's nodes describe without a text."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from network import Network, eventually
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

import rosz.bags
from rosz.bags import Channel, create_writer
from rosz.bags.record import BagFiles, Recorder, RecordOptions, Selection
from rosz.cli.main import run
from rosz.message import Message
from rosz.msgs.type_description_interfaces.msg import (
    Field,
    FieldType,
    IndividualTypeDescription,
    TypeDescription,
    TypeSource,
)
from rosz.msgs.type_description_interfaces.srv import (
    GetTypeDescriptionRequest,
    GetTypeDescriptionResponse,
)
from rosz.node.ros2.types import describe_type, request_type
from rosz.typestore import TypeStore
from rosz.wire import Kind

pytestmark = pytest.mark.system

TOPIC = "/do/_service_event"
INFO = "service_msgs/msg/ServiceEventInfo"
TYPES = TypeStore()
TEXTS = {
    "strange/srv/Do_Request": "bool ok\n",
    "strange/srv/Do_Response": "string text\n",
}
EVENT = f"""{INFO} info
strange/srv/Do_Request[<=1] request
strange/srv/Do_Response[<=1] response
"""


def individual(name: str, *fields: tuple[str, FieldType]) -> IndividualTypeDescription:
    return IndividualTypeDescription(name, [Field(one, kind, "") for one, kind in fields])


def describe(_: object, request: GetTypeDescriptionRequest) -> GetTypeDescriptionResponse:
    """Respond as a node of ROS 2 does for the events of its service."""
    assert request.type_name == "strange/srv/Do_Event"
    info = describe_type(TYPES, GetTypeDescriptionRequest(INFO, "", False)).type_description
    whole = individual(
        "strange/srv/Do_Event",
        ("info", FieldType(1, 0, 0, INFO)),
        ("request", FieldType(97, 1, 0, "strange/srv/Do_Request")),
        ("response", FieldType(97, 1, 0, "strange/srv/Do_Response")),
    )
    others = [
        *(info.type_description, *info.referenced_type_descriptions),
        individual("strange/srv/Do_Request", ("ok", FieldType(15))),
        individual("strange/srv/Do_Response", ("text", FieldType(17))),
    ]
    names: Iterable[str] = (one.type_name for one in (whole, *others))
    return GetTypeDescriptionResponse(
        successful=True,
        type_description=TypeDescription(whole, others),
        type_sources=[TypeSource(one, "implicit", "") for one in names],
    )


def event() -> type[Message]:
    return TYPES.message_from_text("strange/srv/Do_Event", EVENT, TEXTS)


def test_events_are_recorded_with_their_definition(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosz.node.ros2.types.describe_type", describe)
    cls = event()
    request = TYPES.message_from_text("strange/srv/Do_Request", "bool ok\n")
    publisher = network.node("server").publisher(TOPIC, cls, latch=True)
    publisher.publish(cls(request=[request(ok=True)]))
    node = network.node("record")
    said: list[str] = []
    options = RecordOptions(name=str(network.folder / "x"))
    with (
        BagFiles(options, said.append) as files,
        Recorder(node, Selection(services=True), files, said.append) as recorder,
    ):
        eventually(lambda: files.count == 1)
        assert recorder.topics == [TOPIC]
    assert not [one for one in said if "WARNING" in one]
    path = network.folder / "x.mcap"
    with rosz.bags.open(path) as bag:
        (entry,) = bag.messages()
        channel = entry.entry.channel
        assert (channel.type, channel.type_hash) == ("strange/srv/Do_Event", cls._type_hash)
        found = entry.message
        assert [one.ok for one in found.request] == [True]  # type: ignore[attr-defined]
    # Others know names such as package/Name only.
    assert "strange/DoRequest[<=1] request\n" in channel.definition
    assert "MSG: strange/DoRequest\nbool ok\n" in channel.definition


SERVICE = f"""# asks
bool ok
geometry_msgs/Point at
---
string text
{"=" * 80}
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
"""
POINTS = {
    "strange/srv/Do_Request": "bool ok\ngeometry_msgs/Point at\n",
    "strange/srv/Do_Response": "string text\n",
}


@pytest.mark.parametrize("form", ["a service", "a message"])
def test_events_of_rosbag2_are_decoded_and_others_read_the_copy(
    tmp_path: Path, form: str, capsys: pytest.CaptureFixture[str]
) -> None:
    cls = TYPES.message_from_text("strange/srv/Do_Event", EVENT, POINTS)
    request = TYPES.message_from_text("strange/srv/Do_Request", POINTS["strange/srv/Do_Request"])
    data = cls(request=[request(ok=True)]).to_cdr()
    text = SERVICE if form == "a service" else cls._full_text
    channel = Channel(TOPIC, cls._type_name, definition=text, type_hash=cls._type_hash)
    with create_writer(f"{tmp_path}/b/", storage="sqlite3") as writer:  # keeps text and name
        writer.write(writer.add(channel), 5, data)
    for words in (["info"], ["check"], ["cat", "-n", "1"]):
        assert run(["bag", words[0], f"{tmp_path}/b", *words[1:]]) == 0, words
    assert "ok: True" in capsys.readouterr().out
    copy = tmp_path / "a.mcap"
    assert run(["bag", "convert", f"{tmp_path}/b", str(copy)]) == 0
    with rosz.bags.open(copy) as bag:
        (entry,) = bag.messages()
        assert entry.entry.channel.type == "strange/srv/Do_Event"
        assert entry.entry.channel.type_hash == cls._type_hash
        assert entry.message.request[0].ok  # type: ignore[attr-defined]
    with AnyReader([copy], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        ((connection, _, raw),) = reader.messages()
        assert reader.deserialize(raw, connection.msgtype).request[0].ok  # type: ignore[attr-defined]
    with copy.open("rb") as file:
        decoded = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
        assert [one.decoded_message.request[0].ok for one in decoded] == [True]


def test_the_type_of_events_is_that_of_the_node(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosz.node.ros2.types.describe_type", describe)
    cls = event()
    network.node("server").publisher(TOPIC, cls)
    node = network.node("listener")
    followed = node.keep(node.context.graph.follow_entities(Kind.PUBLISHER, TOPIC))
    eventually(lambda: followed.view().publishers(TOPIC))
    (token,) = followed.view().publishers(TOPIC)
    assert token.type_name == "strange/srv/Do_Event"
    made = request_type(node, token)
    assert made._type_hash == cls._type_hash == token.type_hash
