"""What waits for a time, or for the start or end of a process."""

from __future__ import annotations

from textwrap import dedent

import pytest
from network import Network

from rosz.launch.plan import Trigger

from .conftest import HEAD, Folder

TARGET = "first := ExecuteProcess(cmd=['true'], name='first')"
IMPORTS = "from launch.event_handlers import *\nfrom launch.events import Shutdown as End\n"


@pytest.mark.pure
def test_handlers_give_actions_an_event(folder: Folder) -> None:
    plan = folder.plan(
        f"""
        RegisterEventHandler(OnProcessExit(target_action=({TARGET}), on_exit=[
            Node(package='robot', executable='a', name='second'),
            TimerAction(period=2.0, actions=[LogInfo(msg='later'), RegisterEventHandler(
                OnProcessStart(on_start=LogInfo(msg='any')))]),
        ])),
        first,
        TimerAction(period='1.5', actions=[Node(package='robot', executable='b', name='third',
            on_exit=EmitEvent(event=End(reason='over')))]),
        Node(package='robot', executable='a', condition=IfCondition('false'), on_exit=[Shutdown()]),
        """,
        head=IMPORTS,
    )
    exits = Trigger("exit", "/first")
    assert [(node.name, node.after, node.spawn_delay) for node in plan.nodes] == [
        ("first", None, 0.0),
        ("third", None, 1.5),
        ("second", exits, 0.0),
    ]
    assert [(step.text, step.shutdown, step.after, step.delay) for step in plan.steps] == [
        ("later", False, exits, 2.0),
        ("over", True, Trigger("exit", "/third"), 0.0),
        ("any", False, Trigger("start", ""), 0.0),
    ]


@pytest.mark.pure
@pytest.mark.parametrize(
    ("handler", "error"),
    [
        (
            "OnProcessExit(on_exit=lambda event, context: None)",
            "1: rosz takes actions and processes here, and no functions",
        ),
        (
            "OnProcessExit(target_action=LogInfo(msg=''), on_exit=[])",
            "1: rosz takes actions and processes here, and no functions",
        ),
        ("OnProcessExit(on_exit=['text'])", "1: 'text' is not an action"),
    ],
)
def test_handlers_take_actions_only(folder: Folder, handler: str, error: str) -> None:
    assert folder.error(f"RegisterEventHandler({handler})", head=IMPORTS) == error


@pytest.mark.pure
def test_what_is_for_the_end_is_left_out(folder: Folder) -> None:
    text = "RegisterEventHandler(OnShutdown(on_shutdown=[LogInfo(msg='')]))"
    (warning,) = folder.plan(text, head=IMPORTS).warnings
    assert warning.text.startswith("what OnShutdown holds is left out")


def run(network: Network, entities: str) -> list[str]:
    """Launch a file, and return the lines of its programs and steps."""
    file = network.folder / "x.launch.py"
    file.write_text(f"{IMPORTS}{HEAD}{dedent(entities)}\n    ])\n")
    launch = network.run("-m", "rosz", "launch", "--no-summary", str(file))
    assert launch.exit_code() == 0, launch.output
    return [line for line in launch.lines if line.startswith("said")]


def test_a_launch_follows_its_events(network: Network) -> None:
    lines = run(
        network,
        """
        RegisterEventHandler(OnProcessExit(
            target_action=(first := ExecuteProcess(cmd=['echo', 'said 1'], output='screen')),
            on_exit=[ExecuteProcess(cmd=['echo', 'said 2'], output='screen', on_exit=[
                TimerAction(period=0.1, actions=[LogInfo(msg='said 3'), Shutdown(reason='said 4')]),
                ExecuteProcess(cmd=['sleep', '1000'])])],
        )),
        LogInfo(msg='said 0'),
        first,
        """,
    )
    assert lines == ["said 0", "said 1", "said 2", "said 3", "said 4"]


def test_a_launch_ends_when_an_event_cannot_come(network: Network) -> None:
    file = network.folder / "x.launch.py"
    text = "ExecuteProcess(cmd=['no-such-program'], on_exit=ExecuteProcess(cmd=['sleep', '1000']))"
    file.write_text(f"{HEAD}{text}\n    ])\n")
    launch = network.run("-m", "rosz", "launch", "--no-summary", str(file))
    assert launch.exit_code() == 1
    launch.wait_for("all processes on machine have died")
