"""rviz of Debian, without a screen, with rosz as its master."""

from __future__ import annotations

import shutil

import pytest
from network import TIMEOUT, eventually

from rosz.msgs.geometry_msgs.msg import TransformStamped
from rosz.msgs.std_msgs.msg import Header
from rosz.msgs.std_srvs.srv import Empty
from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.msgs.visualization_msgs.msg import Marker

from .world import World

pytestmark = [
    pytest.mark.ros1,
    pytest.mark.system,
    pytest.mark.skipif(
        not (shutil.which("rviz") and shutil.which("xvfb-run")),
        reason="needs rviz and xvfb-run (Debian: rviz, xvfb)",
    ),
]

_LONG = 4 * TIMEOUT
_SETTINGS = """Visualization Manager:
  Class: ""
  Displays:
    - {Class: rviz/Marker, Name: M, Enabled: true, Marker Topic: visualization_marker}
    - {Class: rviz/TF, Name: TF, Enabled: true}
  Global Options:
    Fixed Frame: world
  Enabled: true
"""


def test_rviz_shows_what_rosz_publishes() -> None:
    world = World()
    try:
        node = world.network.node("shower")
        transform = TransformStamped(header=Header(frame_id="world"), child_frame_id="map")
        transform.transform.rotation.w = 1.0
        node.publisher("/tf_static", TFMessage, latch=True).publish([transform])
        marker = Marker(header=Header(frame_id="map"), type=Marker.CUBE)
        marker.pose.orientation.w = marker.scale.x = marker.scale.y = marker.scale.z = 1.0
        marker.color.a = 1.0
        node.publisher("/visualization_marker", Marker, latch=True).publish(marker)
        settings = world.network.folder / "settings.rviz"
        settings.write_text(_SETTINGS)
        screen = ("xvfb-run", "-a", "-s", "-screen 0 640x480x24", "env", "LIBGL_ALWAYS_SOFTWARE=1")
        rviz = world.start(*screen, "rviz", "-d", str(settings), "__name:=rviz")
        client = node.client("/rviz/reload_shaders", Empty, timeout=_LONG)
        client.wait_for_service(_LONG)

        def receives() -> bool:
            info = world.run("rosnode", "info", "/rviz")
            return all(f"* topic: {name}\n" in info for name in ("/tf_static", shown))

        shown = "/visualization_marker"
        eventually(receives, "rviz, connected to what it shows", _LONG)
        client()  # it answers from the loop that draws
        view = node.context.graph.view
        assert "/rviz" in view().nodes()
        assert all(view().subscriptions(name) for name in ("/tf", "/tf_static", shown))
        assert not [line for line in rviz.lines if "ERROR]" in line or "WARN]" in line]
    finally:
        world.close()
