"""roslib.msgs and roslib.srvs: files of definitions."""

from __future__ import annotations

from pathlib import Path

import pytest

from ros1.test_importer import run
from rosz.ros1.tools.roslib import msgs


def test_definitions_of_a_package() -> None:
    assert "String" in msgs.list_msg_types("std_msgs", include_depends=False)
    assert "SetBool" in msgs.list_srv_types("std_srvs", include_depends=False)
    assert Path(msgs.msg_file("std_msgs", "String")).is_file()
    assert Path(msgs.srv_file("std_srvs", "SetBool")).is_file()


@pytest.mark.parametrize(
    ("line", "instead"),
    [
        ("import roslib.gentools", "_md5sum"),
        ("import roslib.manifest", "rospkg.RosPack().get_manifest(PACKAGE)"),
        ("import roslib.stacks", "rospkg.RosStack()"),
        ("import rospkg.os_detect", "platform.freedesktop_os_release()"),
        ("import rosunit.xmlrunner", "rosunit.unitrun()"),
        ("import roswtf", "rosz doctor"),
        ("import roslib.msgs; roslib.msgs.MsgSpec", "_slot_types"),
    ],
)
def test_missing_modules_name_their_replacement(line: str, instead: str, tmp_path: Path) -> None:
    code = f"""
        import rosz.ros1
        try:
            {line}
        except (ImportError, AttributeError) as error:
            print(error)
        """
    assert instead in run(code, tmp_path)
