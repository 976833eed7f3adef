"""camera_info_manager: calibrations in files, replaced by a service."""

from __future__ import annotations

from pathlib import Path

import pytest
from network import Network

from rosz.msgs.sensor_msgs.msg import CameraInfo
from rosz.ros1.libraries import camera_info_manager as manager


@pytest.mark.parametrize(
    ("url", "kind"),
    [
        ("", manager.URL_empty),
        ("FILE:///tmp/a.yaml", manager.URL_file),
        ("packAge://p/x", manager.URL_package),
        ("file://", manager.URL_invalid),
        ("package://", manager.URL_invalid),
        ("package:///", manager.URL_invalid),
        ("package://x.yaml", manager.URL_invalid),
        ("package://p/", manager.URL_invalid),
    ],
)
def test_urls(url: str, kind: int) -> None:
    assert manager.parseURL(url) == kind


def test_variables_of_urls(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_HOME", "/ros")
    url = "file://${ROS_HOME}/$${NAME}/$x/$$"
    assert manager.resolveURL(url, "left") == "file:///ros/$left/$x/$$"
    monkeypatch.delenv("ROS_HOME")
    monkeypatch.setenv("HOME", "/me")
    assert manager.resolveURL(url, "left") == "file:///me/.ros/$left/$x/$$"
    assert manager.genCameraName("C++ 1") == "C___1"


def test_a_file_is_read_as_it_was_written(tmp_path: Path) -> None:
    given = CameraInfo(width=4, height=3, distortion_model="plumb_bob", d=[0.5], k=[2.0] * 9)
    file = tmp_path / "new" / "left.yaml"
    assert manager.saveCalibrationFile(given, str(file), "left")
    assert manager.loadCalibrationFile(str(file), "left") == given
    assert manager.loadCalibrationFile(str(tmp_path / "none"), "left") == CameraInfo()
    assert not manager.saveCalibrationFile(given, "/proc/nothing/x.yaml", "left")
    file.write_text("camera_name: left\n")
    with pytest.raises(manager.CameraInfoError, match=r"left\.yaml\] is not a calibration: no 'im"):
        manager.loadCalibrationFile(str(file), "left")


def test_the_service_replaces_a_calibration(network: Network) -> None:
    program = network.program(
        """
        import rosz.ros1
        import rospy
        from camera_info_manager import *
        rospy.init_node("camera")
        camera = CameraInfoManager("left", "", "ns")
        try:
            camera.isCalibrated()
        except CameraInfoMissingError as error:
            print(error)
        camera.loadCameraInfo()
        print(camera.isCalibrated(), camera.setCameraName("a b"), camera.setURL("x:"))
        call = rospy.ServiceProxy("ns/set_camera_info", SetCameraInfo)
        print(call(CameraInfo(K=[3.0] * 9)).success, camera.isCalibrated())
        camera.loadCameraInfo()
        print(camera.getCameraInfo().K[0])
        """,
        ROS_HOME=str(network.folder / "home"),
    )
    assert program.exit_code() == 0, program.output
    assert [line for line in program.lines if not line.startswith("[INFO]")] == [
        "Calibration missing, loadCameraInfo() needed.",
        "False False False",
        "True True",
        "3.0",
    ]
