"""``<machine>``: where nodes may run."""

from __future__ import annotations

from rosz.launch.plan.fault import TextFault
from rosz.launch.plan.ledger import Ledger
from rosz.launch.plan.model import MachinePlan
from rosz.launch.plan.tag import Tag
from rosz.launch.plan.tags import misplaced

__all__ = ("read_machine",)

_DEFAULT_TIMEOUT = 10.0
_DEFAULT_PORT = 22
_MAX_PORT = 65535
_OLD = ("ros-root", "ros-package-path", "ros-ip", "ros-hostname")
_DEFAULTS = ("true", "false", "never")


def read_machine(tag: Tag, ledger: Ledger) -> None:
    """Read ``<machine>``.

    Raises:
        Fault: An attribute is missing or wrong, or another machine has the name.
    """
    for old in _OLD:
        if tag.get(old):
            tag.fail(f"'{old}' is no longer supported; let 'env-loader' set the environment", old)
    tag.check()
    name, address = tag.require("name"), tag.require("address")
    default = (tag.get("default") or "false").lower()
    if default not in _DEFAULTS:
        tag.fail(f"'default' is '{default}'; expected {', '.join(_DEFAULTS)}", "default")
    for element in tag.element.children:
        inner = tag.inside(element, tag.scope)
        if element.tag == "env":
            inner.fail("<machine> no longer takes <env>; let 'env-loader' set the environment")
        inner.warn(misplaced(element.tag, "machine"))
    machine = MachinePlan(
        name=name,
        address=address,
        env_loader=tag.get("env-loader") or "",
        ssh_port=_port(tag),
        user=tag.get("user") or "",
        password=tag.get("password") or "",
        timeout=_timeout(tag),
        assignable=default != "never",
        place=tag.place,
    )
    try:
        ledger.add_machine(machine)
    except TextFault as fault:
        tag.fail(fault.reason, "name")
    if default == "true":
        ledger.default_machine = name


def _port(tag: Tag) -> int:
    port = tag.whole("ssh-port", _DEFAULT_PORT, 1) or _DEFAULT_PORT
    if port > _MAX_PORT:
        tag.fail(f"'ssh-port' is '{port}'; expected {_MAX_PORT} or less", "ssh-port")
    return port


def _timeout(tag: Tag) -> float:
    timeout = tag.number("timeout", _DEFAULT_TIMEOUT)
    if timeout <= 0:
        tag.fail(f"'timeout' is '{timeout:g}'; expected more than 0 seconds", "timeout")
    return timeout
