"""What ``rosz env --editor`` writes: type checkers know the names of ROS 1 and of the workspace."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from cli.command import rosz

CODE = """\
import actionlib
import dynamic_reconfigure
import rospy
import rospy.core
import sensor_msgs.msg
import tf
import tf2_ros
from demo.msg import Number
from demo.tools import help
from geometry_msgs.msg import Twist

reveal_type(Twist().linear.x)
reveal_type(Number().name)
reveal_type(help)
reveal_type(rospy.Publisher("x", Twist, queue_size=1).get_num_connections())
reveal_type(actionlib.GoalStatus().status)
reveal_type(tf.msg.tfMessage().transforms[0].child_frame_id)
reveal_type(sensor_msgs.msg.Image().width)
actionlib.SimpleActionClient
actionlib.action
dynamic_reconfigure.client.Client
dynamic_reconfigure.msg.Config
sensor_msgs.point_cloud2.read_points
tf.ConnectivityException, tf.Exception, tf.TransformBroadcaster, tf.TransformerROS
tf.listener.TransformListener is tf.TransformListener
tf.transformations.quaternion_from_euler(0.0, 0.0, 0.0)
Twist().linear.nope
"""


def test_type_checkers_know_the_names(tmp_path: Path) -> None:
    (tmp_path / "src").mkdir()
    rosz(tmp_path / "src", "pkg", "create", "demo")
    code = tmp_path / "src" / "demo" / "src" / "demo"
    code.mkdir(parents=True)
    (code / "__init__.py").touch()
    (code / "tools.py").write_text("help = 1.5\n")
    before = set((tmp_path / "src").rglob("*"))
    made = json.loads(rosz(tmp_path, "env", "--editor", "--json").stdout)
    folder = Path(made["folder"])
    assert set((tmp_path / "src").rglob("*")) == before
    (tmp_path / "use.py").write_text(CODE)
    (tmp_path / "pyrightconfig.json").write_text(
        json.dumps(
            {"extraPaths": [str(folder)], "include": ["use.py"], "typeCheckingMode": "basic"}
        )
    )
    done = subprocess.run(
        [sys.executable, "-m", "basedpyright", "--pythonpath", sys.executable, "--outputjson"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    found = json.loads(done.stdout)["generalDiagnostics"]
    texts = [one["message"].splitlines()[0] for one in found if one["severity"] == "information"]
    assert [text.rpartition(" is ")[2] for text in texts] == [
        '"float"',
        '"str"',
        '"float"',
        '"int"',
        '"int"',
        '"str"',
        '"int"',
    ]
    errors = [one["message"] for one in found if one["severity"] == "error"]
    assert len(errors) == 1, errors
    assert "nope" in errors[0]

    # Kept fresh: a new message is there after a check, and what is gone is removed.
    (tmp_path / "src" / "demo" / "msg" / "More.msg").write_text("bool yes\n")
    (code / "tools.py").unlink()
    assert rosz(tmp_path, "pkg", "check").returncode == 0
    assert "class More" in (folder / "demo" / "msg.py").read_text()
    assert not (folder / "demo" / "tools.py").is_symlink()
    assert (code / "__init__.py").exists()
