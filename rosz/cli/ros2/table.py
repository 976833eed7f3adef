"""The commands of ``ros2``: where each is, what it does, and its options.

A line that begins with ``:`` is a command: its words, its module and function, its description.
Below it stand its options and arguments, each with its description behind ``|``: spellings, the
name of a value with ``?``, ``*``, ``+`` or ``...`` for its number, ``:`` and its type, ``=`` and
its default, ``~`` and what stands for it when it is left out; choices in brackets, ``@`` and the
group of options that exclude each other, ``>`` and its name for the program. ``$`` and a name
stand for the lines of a part.
"""

from __future__ import annotations

import os
import re
from argparse import REMAINDER, ArgumentTypeError
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

GROUPS = {
    "action": "Various action related sub-commands",
    "bag": "Various rosbag related sub-commands",
    "daemon": "Various daemon related sub-commands",
    "interface": "Show information about ROS interfaces",
    "lifecycle": "Various lifecycle related sub-commands",
    "multicast": "Various multicast related sub-commands",
    "node": "Various node related sub-commands",
    "param": "Various param related sub-commands",
    "pkg": "Various package related sub-commands",
    "service": "Various service related sub-commands",
    "topic": "Various topic related sub-commands",
}
"""The groups of commands, with their descriptions."""

_PARTS = {
    "direct": """
--spin-time SPIN_TIME:float | ignored: nothing has to spin
-s --use-sim-time | ignored: nodes know it by themselves""",
    "strategy": """
$direct
--no-daemon | ignored: rosz has no daemon""",
    "type": "-t --show-types | print the types as well",
    "content": """
--csv | print values with commas between them
-f --full-length | print long arrays and texts whole
-l --truncate-length LENGTH:count=128 | items and letters that are printed of an array or a text
--no-arr | leave out arrays
--no-str | leave out texts
--flow-style | print collections on one line""",
    "qos": """
--qos-depth N:int | depth of the queue
--qos-history [system_default keep_last keep_all unknown] | which samples are kept
--qos-reliability [system_default reliable best_effort unknown best_available] | may samples be lost
--qos-durability [system_default transient_local volatile unknown best_available] | for late ones
--qos-liveliness [system_default automatic manual_by_topic unknown best_available] | liveliness
--qos-liveliness-lease-duration-seconds SECONDS:float | its lease""",
    "profiles": "[unknown default system_default sensor_data services_default parameters"
    " parameter_events action_status_default best_available rosout_default]",
    "node": """
$strategy
node_name >node | full name of a node
--include-hidden-nodes >hidden | find hidden nodes as well""",
    "timeout": "--timeout N:int=1 | seconds to wait for the node",
    "doctor": """
-r --report @report | print what is there
-rf --report-failed @report | print what is there, if a check fails
-ep --exclude-packages | ignored
-iw --include-warnings | count warnings as faults""",
    "window": """
-w --window WINDOW:whole=10000 >window | messages to average
$direct""",
    "kinds": """
-m --only-msgs | only messages
-s --only-srvs | only services
-a --only-actions | only actions""",
    "bag": """
bag_path:exists | the bag
-s --storage ID= | its storage, which is found out""",
}

_TABLE = """
:topic list listing:list_names Output a list of available topics
$strategy
$type
-c --count-topics >count | print only how many there are
--include-hidden-topics >hidden | list hidden topics as well
-v --verbose | print how many publish and subscribe
:topic info listing:topic_info Print information about a topic
$strategy
topic_name >name | name of a topic
-v --verbose | print each publisher and subscription
:topic type listing:print_types Print a topic's type
$strategy
topic_name >name | name of a topic
:topic find listing:find_names Output a list of available topics of a given type
$strategy
topic_type >type | type of the topics
-c --count-topics >count | print only how many there are
--include-hidden-topics >hidden | list hidden topics as well
:topic echo topics:echo Output messages from a topic
$strategy
topic_name >name | name of a topic
message_type? >type | its type
--qos-profile =sensor_data $profiles | profile to begin with
$qos
$content
--field FIELD | print one field, such as pose.position
--no-lost-messages | do not tell of lost messages
--raw | print the bytes
--filter EXPR | print only messages m for which a Python expression is true
--once | stop after one message
--timeout N:positive | stop after N seconds
-i --include-message-info | print where a message is from as well
-c --clear | clear the screen before each message
-n --node-name NAME | name of the node that listens
:topic hz topics:hz Print the average publishing rate to screen
topic_name+ >names | names of topics
$window
--filter EXPR | count only messages m for which a Python expression is true
--wall-time | measure by the wall clock
:topic bw topics:bandwidth Display bandwidth used by topic
topic >name | name of a topic
-w --window WINDOW:whole=100 >window | messages to average
$direct
:topic delay topics:delay Display delay of topic from timestamp in header
topic >name | name of a topic
$window
:topic pub topics:publish Publish a message to a topic
topic_name >name | name of a topic
message_type >type | its type
values?={} @values | the message in YAML
--stdin @values | read the message from standard input
-r --rate N:positive=1.0 | messages per second
-p --print N:int=1 | print only each N-th message
-1 --once @times | publish one message
-t --times N:count=0 @times | stop after N messages
-w --wait-matching-subscriptions N:count | subscriptions to wait for
--max-wait-time-secs N:positive | seconds to wait for them
--keep-alive N:positive=0.1 | seconds to stay at the end
-n --node-name NAME | name of the node that publishes
--qos-profile =default $profiles | profile to begin with
$qos
$direct
:service list listing:list_names Output a list of available services
$strategy
$type
-c --count-services >count | print only how many there are
--include-hidden-services >hidden | list hidden services as well
:service type listing:print_types Output a service's type
service_name >name | name of a service
:service find listing:find_names Output a list of available services of a given type
service_type >type | type of the services
-c --count-services >count | print only how many there are
--include-hidden-services >hidden | list hidden services as well
:service info listing:service_info Print information about a service
$strategy
service_name >name | name of a service
-v --verbose | print each server and client
:service call calls:call Call a service
service_name >name | name of a service
service_type >type | its type
values?={} @values | the request in YAML
--stdin @values | read the request from standard input
-r --rate N:float | calls per second, until stopped
:service echo topics:echo_service Echo a service
service_name >name | name of a service
service_type? >type | its type
$content
:action list listing:list_names Output a list of action names
$type
-c --count-actions >count | print only how many there are
:action info listing:action_info Print information about an action
action_name >name | name of an action
$type
-c --count | print only how many clients and servers there are
:action type listing:print_types Print a action's type
action_name >name | name of an action
:action find listing:find_names Find actions from type
action_type >type | type of the actions
-c --count-actions >count | print only how many there are
:action send_goal calls:send_goal Send an action goal
action_name >name | name of an action
action_type >type | its type
goal?={} @values >values | the goal in YAML
--stdin @values | read the goal from standard input
-f --feedback | print feedback as it comes
:node list listing:list_nodes Output a list of available nodes
$strategy
-a --all >hidden | list hidden nodes as well
-c --count-nodes >count | print only how many there are
:node info listing:node_info Output information about a node
$strategy
node_name >node | full name of a node
--include-hidden >hidden | list hidden names as well
:param delete params:delete Delete parameter
$node
parameter_name >parameter | name of a parameter
$timeout
:param describe params:describe Show descriptive information about declared parameters
$node
parameter_names+ | names of parameters
$timeout
:param dump params:dump Show all of the parameters of a node in a YAML file format
$node
$timeout
:param get params:get Get parameter
$node
parameter_name >parameter | name of a parameter
--hide-type | print only the value
$timeout
:param list params:list_parameters Output a list of available parameters
$strategy
node_name? >node | full name of a node
--filter REGEX | only names that match an expression
--include-hidden-nodes >hidden | find hidden nodes as well
--param-prefixes PREFIX+ | only names with a prefix
--param-type | print the types as well
:param load params:load Load parameter file for a node
$node
parameter_file | file of parameters
--no-use-wildcard | leave out what is for all nodes
$timeout
:param set params:set_parameter Set parameter
$node
parameter_name >parameter | name of a parameter
value | value in YAML
$timeout
:interface list packages:list_interfaces List all interface types available
$kinds
:interface package packages:interfaces_of List the interface types of a package
$kinds
package_name >package | name of a package
:interface packages packages:interface_packages Output a list of packages that provide interfaces
$kinds
:interface proto packages:prototype Output an interface prototype
type | name of a type
--no-quotes | print it without quotes
:interface show packages:show Output the interface definition
--all-comments @comments | with the comments of types in it
--no-comments @comments | without comments and empty lines
type | name of a type; - reads it from standard input
:pkg create packages:create Create a new ROS 2 package
package_name >package | name of the package
--package-format --package_format =3 [2 3] | format of package.xml, 2 or 3
--description TEXT | what it is
--license NAME | its license
--destination-directory FOLDER=. | where to create it
--build-type =ament_cmake [cmake ament_cmake ament_python] | how it is built
--dependencies NAME+ | packages that it needs
--maintainer-email ADDRESS | address of the maintainer
--maintainer-name NAME | name of the maintainer
--node-name NAME | name of a program to begin with
--library-name NAME | name of a library to begin with
:pkg executables packages:executables Output a list of package specific executables
package_name? >package | name of a package
--full-path | print paths
:pkg list packages:list_packages Output a list of available packages
:pkg prefix packages:prefix Output the prefix path of a package
package_name >package | name of a package
--share | print the share folder
:pkg xml packages:manifest Output the XML of the package manifest or a specific tag
package_name >package | name of a package
-t --tag TAG | print only the text of a tag
:lifecycle get lifecycle:get Get lifecycle state for one or more nodes
$strategy
node_name? >node | full name of a node
--include-hidden-nodes >hidden | find hidden nodes as well
:lifecycle list lifecycle:transitions Output a list of available transitions
$node
-a --all | print all transitions
:lifecycle nodes lifecycle:nodes Output a list of nodes with lifecycle
$strategy
-a --all >hidden | list hidden nodes as well
-c --count-nodes >count | print only how many there are
:lifecycle set lifecycle:change Trigger lifecycle state transition
$node
transition | name or number of a transition
:bag info bag:info Print information about a bag to the screen
$bag
-t --topic-name | print only the names of topics
-v --verbose | ignored
--sort =name [name type count] | order of topics
:bag play bag:play Play back ROS data from a bag
$bag
-r --rate N:positive=1.0 | factor of time
--topics TOPIC+ | play only these topics
-l --loop | begin again at the end
--clock HZ?:positive~40 | publish /clock
-d --delay N:positive | seconds before it plays
--start-offset N:float | seconds to leave out
--playback-duration N:float | seconds to play
-p --start-paused | begin with a pause
--disable-keyboard-controls | ignored
--read-ahead-queue-size N:int | ignored
:bag record bag:record Record ROS data to a bag
topics_positional* @topics | topics to record
--topics TOPIC+ @topics | topics to record
-a --all | record all topics and services
--all-topics | record all topics
--all-services | record the events of all services
-e --regex REGEX= | record topics that match
--exclude-regex REGEX= | leave out topics that match
--exclude-topics TOPIC+ | leave out these topics
-o --output NAME | folder of the bag
-s --storage =mcap [mcap] | its storage
-b --max-bag-size N:count=0 | bytes of a file
-d --max-bag-duration N:count=0 | seconds of a file
--max-cache-size N:count=104857600 | bytes that may wait
--compression-mode =none [none file message] | what is compressed, with zstd
--compression-format FORMAT= | ignored
:daemon start system:start_daemon Start the daemon if it isn't running
-d --debug | ignored
:daemon status system:daemon_status Output the status of the daemon
:daemon stop system:stop_daemon Stop the daemon if it is running
:multicast receive system:multicast Receive a single UDP multicast packet
:multicast send system:multicast Send a single UDP multicast packet
:doctor system:doctor Check ROS setup and other potential issues
$doctor
:wtf system:doctor Use `wtf` as alias to `doctor`
$doctor
:launch system:launch Run a launch file
-n --noninteractive | ignored
-d --debug | print more
-p --print --print-description @print | print what would start
-s --show-args --show-arguments @print | list the arguments
-a --show-all-subprocesses-output | show the output of all nodes
package_name >package | a package, or the path of a launch file
launch_file_name? | name of a launch file
launch_arguments* | arguments, name:=value
:run system:run Run a package specific executable
--prefix COMMAND | run it with a command
package_name >package | name of a package
executable_name | name of the program
argv... | arguments of the program
"""

_HEAD = re.compile(r":([a-z_ ]+) (\w+:\w+) (.*)")
_CHOICES = re.compile(r"\[(.*)\]")
_VALUE = re.compile(r"(\w*)([?*+]|\.\.\.)?(?::(\w+))?(?:=([^~]*))?(?:~(\S+))?")


class Verb(NamedTuple):
    """A command.

    Attributes:
        place: Module and function.
        text: Description for help.
        lines: The lines of its options and arguments.
    """

    place: str
    text: str
    lines: list[str]


class Flag(NamedTuple):
    """An option or an argument.

    Attributes:
        names: The spellings of an option, or the name of an argument.
        group: Name of the group of options that exclude each other.
        settings: Further arguments of argparse.
    """

    names: list[str]
    group: str
    settings: dict[str, Any]


def verbs() -> dict[str, Verb]:
    """Return all commands by their words."""
    commands: dict[str, Verb] = {}
    lines: list[str] = []
    for line in _TABLE.strip().splitlines():
        head = _HEAD.fullmatch(line)
        if head is None:
            lines.append(line)
        else:
            lines = []
            commands[head[1]] = Verb(head[2], head[3], lines)
    return commands


def flags(lines: Iterable[str]) -> Iterator[Flag]:
    """Yield the options and arguments of the lines of a command."""
    for line in lines:
        if line.startswith("$"):
            yield from flags(_PARTS[line[1:]].strip().splitlines())
        else:
            yield _read(line.replace("$profiles", _PARTS["profiles"]))


def _read(line: str) -> Flag:
    form, _, text = line.partition(" | ")
    choices = _CHOICES.search(form)
    words = _CHOICES.sub("", form).split()
    names = [word for word in words if word.startswith("-")]
    marks = {word[0]: word[1:] for word in words if word[0] in "@>"}
    value = next((word for word in words if word[0] not in "-@>"), "")
    # The pattern takes any text.
    name, number, kind, default, constant = _VALUE.fullmatch(value).groups()  # type: ignore[union-attr]
    several = number == "*" or (number == "+" and names)
    settings: dict[str, Any] = {
        "help": text,
        "action": None if value or choices else "store_true",
        "choices": choices[1].split() if choices else None,
        "dest": marks.get(">"),
        "metavar": name or None,
        "nargs": REMAINDER if number == "..." else number,
        "type": _TYPES.get(kind),
        "default": [] if several else default,
        "const": constant,
    }
    given = {key: each for key, each in settings.items() if each is not None}
    return Flag(names or [given.pop("dest", name)], marks.get("@", ""), given)


def _whole(text: str) -> int:
    if not text.isdecimal() or not int(text):
        raise ArgumentTypeError("value must be a positive integer")
    return int(text)


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ArgumentTypeError("Expects a floating point number") from None
    if not value > 0:
        raise ArgumentTypeError("Value must be positive")
    return value


def _existing(text: str) -> str:
    if not os.path.exists(text):  # noqa: PTH110  # importing pathlib takes long
        raise ArgumentTypeError(f"Bag path '{text}' does not exist!")
    return text


def nonnegative_int(text: str) -> int:
    """Return a number of things; argparse shows the name of this function."""
    if int(text) < 0:
        raise ValueError(text)
    return int(text)


_TYPES: dict[str | None, Callable[[str], Any]] = {
    "int": int,
    "float": float,
    "count": nonnegative_int,
    "exists": _existing,
    "whole": _whole,
    "positive": _positive,
}
