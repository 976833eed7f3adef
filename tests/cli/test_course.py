"""Lines that course documents type, as they type them."""

from __future__ import annotations

from network import Network

from .test_env import evaluate

UNTIL = "timeout 200 sh -c 'until {} 2>/dev/null | grep -q {}; do :; done'"


def test_turtles_and_parameters(network: Network) -> None:
    done = evaluate(
        network,
        "bash",
        "trap 'kill $(jobs -p) 2>/dev/null' EXIT",
        "nohup roscore > core.log 2>&1 &",
        UNTIL.format("cat core.log", "started"),
        "rosrun turtlesim turtlesim_node __name:=turtlesim_1 > turtle.log 2>&1 &",
        UNTIL.format("rosservice list", "/spawn"),
        "rosservice type /spawn",
        "rosservice type /spawn | rossrv info",
        "rosservice call /spawn 5 4 0.8 'new_turtle'",
        "rosservice call /clear",
        "rostopic list | grep new_turtle",
        "rosparam list | grep background",
        "rosparam set /turtlesim_1/background_g 255",
        "rosparam get /turtlesim_1/background_g",
        'rosparam set /our_own_param "learning ROS params"',
        "rosparam get /our_own_param",
        "rosparam set my_float 3.14",
        "rosparam get my_float",
        "rosparam dump 1122.yaml",
        "grep -c our_own_param 1122.yaml",
        "rosparam delete /our_own_param",
        "rosparam get /our_own_param",
        "timeout 200 rostopic pub -1 /turtle1/cmd_vel geometry_msgs/Twist"
        " -- '[2.0, 0.0, 0.0]' '[0.0, 0.0, -1.8]'",
        "timeout 200 rostopic echo -n 1 /turtle1/pose | grep -c theta",
        "rosmsg show turtlesim/Pose",
        "kill %1 %2",
        "wait",
        timeout=500,
    )
    out = done.stdout.splitlines()
    assert out[0] == "turtlesim/Spawn", (done.stdout, done.stderr)
    assert out[1:8] == [
        "float32 x",
        "float32 y",
        "float32 theta",
        "string name",
        "---",
        "string name",
        "",
    ]
    assert 'name: "new_turtle"' in out
    assert "/new_turtle/cmd_vel" in out
    assert "/turtlesim_1/background_g" in out
    values = out[out.index("/turtlesim_1/background_r") + 1 :]
    assert values[:4] == ["255", "learning ROS params", "3.14", "1"]
    assert "Parameter [/our_own_param] is not set" in done.stderr
    assert "1" in values[4:]
    assert out[-2:] == ["float32 angular_velocity", ""]
