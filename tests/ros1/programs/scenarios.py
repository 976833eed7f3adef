"""The scenarios: programs that run together, their arguments and signals."""

from __future__ import annotations

import signal
from typing import NamedTuple

__all__ = ("SCENARIOS", "Part", "Scenario")


class Part(NamedTuple):
    """A program of a scenario.

    Attributes:
        script: File name.
        arguments: Command-line arguments.
        variables: Environment variables.
        after: Line that the previous program must write before this one starts.
        interrupt_at: Line of this program after which it gets the signal.
        waits: Whether its main thread waits after that line, and must do so before the signal.
        signal: The signal.
    """

    script: str
    arguments: tuple[str, ...] = ()
    variables: tuple[tuple[str, str], ...] = ()
    after: str = ""
    interrupt_at: str = ""
    waits: bool = True
    signal: signal.Signals = signal.SIGINT


class Scenario(NamedTuple):
    """Programs that run together.

    Attributes:
        name: Name of the scenario.
        parts: The programs, in the order of their start.
        ignored: Texts of lines that ROS and rosz word differently.
    """

    name: str
    parts: tuple[Part, ...]
    ignored: tuple[str, ...] = ()


_MISMATCH = ("Could not process inbound connection: topic types", "they do not reach each other")


def _alone(
    script: str, *arguments: str, name: str = "", ignored: tuple[str, ...] = (), **variables: str
) -> Scenario:
    part = Part(f"{script}.py", arguments, tuple(variables.items()))
    return Scenario(name or script, (part,), ignored)


def _interrupted(
    script: str,
    *arguments: str,
    number: signal.Signals = signal.SIGINT,
    name: str = "",
    waits: bool = True,
) -> Scenario:
    part = Part(f"{script}.py", arguments, interrupt_at="ready", waits=waits, signal=number)
    return Scenario(name or "_".join([script, *arguments]), (part,))


SCENARIOS = (
    _alone("names_resolve"),
    _alone("names_resolve", "__ns:=/robot", "__name:=ears", name="names_in_namespace"),
    _alone("names_resolve", "chatter:=/news", name="names_of_environment", ROS_NAMESPACE="lab/a"),
    _alone("names_resolve", "__ns:=b", name="names_twice_in_namespace", ROS_NAMESPACE="/a"),
    _alone(
        "names_remap", "chatter:=/news", "~out:=result", "/deep/chatter:=/shallow", "ask:=~answer"
    ),
    _alone("names_remap", "speed:=/fast/speed", "__ns:=/r", name="names_remap_parameters"),
    _alone("names_anonymous"),
    _alone("names_bad"),
    _alone("names_myargv", "a:=b", "plain", "-x", "_rate:=5", "__name:=other"),
    _alone("names_own_argv", "__name:=outer"),
    _alone("init_twice"),
    _alone("init_not_yet"),
    _alone("early_entities"),
    _alone("params_basic"),
    _alone("params_errors"),
    _alone("params_search", "__ns:=/a/b"),
    _alone("params_cached"),
    _alone(
        "params_command_line",
        *("_int:=5", "_float:=2.5", "_text:=hello", "_yes:=true", "_no:=False", "_list:=[1, a]"),
        *("_dict:={a: 1, b: {c: x}}", "_quoted:='5'", "_empty:=", "_exp:=1e3", "_deep/er:=1"),
    ),
    Scenario(
        "params_two_nodes",
        (
            Part("params_two_nodes.py", ("asker",)),
            Part("params_two_nodes.py", ("answerer",), after="asked"),
        ),
    ),
    Scenario(
        "topics_two_nodes", (Part("topics_listener.py"), Part("topics_talker.py", after="ready"))
    ),
    Scenario(
        "topics_remapped",
        (
            Part("topics_listener.py", ("chatter:=/a/b", "__name:=ears", "__ns:=/x")),
            Part("topics_talker.py", ("chatter:=b",), (("ROS_NAMESPACE", "/a"),), after="ready"),
        ),
    ),
    _alone("topics_callback_args"),
    _alone("topics_latch"),
    Scenario(
        "topics_latch_several",
        (
            Part("topics_latch_source.py", ("__name:=left",)),
            Part("topics_latch_source.py", ("__name:=right",), after="published"),
            Part("topics_latch_sink.py", after="published"),
        ),
    ),
    _alone("topics_queue"),
    _alone("topics_stale"),
    _alone("topics_any"),
    _alone("topics_header"),
    _alone("topics_peers"),
    _alone("topics_unregister"),
    _alone("topics_publish_forms"),
    _alone("topics_same_twice", ignored=_MISMATCH),
    _alone("topics_no_queue_size"),
    _alone("topics_wait"),
    _alone("topics_published"),
    _alone("topics_exception"),
    _alone("topics_threads"),
    _alone("topics_numpy"),
    Scenario(
        "topics_mismatch",
        (Part("topics_mismatch.py"), Part("topics_mismatch.py", ("talk",), after="ready")),
        _MISMATCH,
    ),
    _alone("services_returns"),
    _alone("services_calls"),
    Scenario(
        "services_two_nodes",
        (Part("services_server.py"), Part("services_client.py", after="ready")),
    ),
    _alone("services_missing"),
    _alone("services_persistent"),
    _alone("services_twice"),
    _alone("services_error_handler"),
    _alone("services_nested"),
    _alone("time_arithmetic"),
    _alone("time_timers"),
    _alone("time_timer_fails"),
    _alone("time_rate"),
    Scenario("time_simulated", (Part("time_clock.py"), Part("time_simulated.py", after="ready"))),
    _alone("time_no_clock"),
    _alone("time_backwards"),
    _alone("shutdown_hooks", ignored=("] [TIME]: shutdown hook ",)),
    _alone("shutdown_after"),
    _alone("shutdown_exit_code", "code", name="shutdown_code"),
    _alone("shutdown_exit_code", "text", name="shutdown_text"),
    _alone("shutdown_exit_code", "failure", name="shutdown_failure"),
    _alone("shutdown_exit_code", "interrupted", name="shutdown_interrupted"),
    _alone("shutdown_exit_code", "end", name="shutdown_end"),
    _interrupted("interrupt_spin"),
    _interrupted("interrupt_spin", number=signal.SIGTERM, name="terminate_spin"),
    _interrupted("interrupt_rate"),
    _interrupted("interrupt_rate", "caught"),
    _interrupted("interrupt_rate", number=signal.SIGTERM, name="terminate_rate"),
    _interrupted("interrupt_sleep"),
    _interrupted("interrupt_sleep", "rospy"),
    _interrupted("interrupt_waits", "message"),
    _interrupted("interrupt_waits", "message_timeout"),
    _interrupted("interrupt_waits", "service"),
    _interrupted("interrupt_waits", "service_timeout"),
    _interrupted("interrupt_busy", waits=False),
    _interrupted("interrupt_unaware", "busy", waits=False),
    _interrupted("interrupt_unaware", "sleep", waits=False),
    _interrupted(
        "interrupt_unaware", "sleep", waits=False, number=signal.SIGTERM, name="terminate_unaware"
    ),
    _interrupted("interrupt_unaware", "server"),
    _interrupted("interrupt_service"),
    _interrupted("interrupt_disabled"),
    _interrupted("interrupt_disabled", "shutdown"),
    _interrupted("interrupt_own_handler", "before"),
    _interrupted("interrupt_own_handler", "after"),
    Scenario(
        "takeover",
        (Part("takeover.py", ("old",)), Part("takeover.py", after="ready")),
        ("shutdown request: ",),
    ),
    _alone("log_levels", "-i"),
    _alone("log_levels", "-d", name="log_levels_debug"),
    _alone("log_levels", "-e", name="log_levels_error"),
    _alone("log_odd"),
    _alone("log_throttled"),
    _alone(
        "log_format",
        ROSCONSOLE_FORMAT="${severity}|${message}|${node}|${function}|${line}|${logger}|${unknown}",
    ),
    _alone("log_python"),
    _alone("log_service"),
    _alone("log_rosout"),
    _alone("messages_print"),
    _alone("messages_make"),
    _alone("messages_own"),
    _alone("messages_genpy"),
    _alone("public_names"),
    _alone("python2_habits"),
)
