"""The settings of a robot in a fleet, as users write them in ``fleet.yaml``.

::

    as: /robot1
    share: [/odom, /scan, "/camera/**@2Hz"]      # names that leave; all if not given
    take: [/cmd_vel]                             # names that come in; all if not given
    common: [/map]                               # names that are the same on both sides
    frames: true                                 # put the prefix before the frames of tf, too

Beyond the machine, ``/odom`` is ``/robot1/odom``. Patterns are names on the robot, as in rules:
``*`` stands for any part of one chunk of a name, ``**`` for any number of chunks.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import msgspec
import yaml

from rosz import names
from rosz.errors import InvalidName, UsageError, near_miss
from rosz.security import PatternReader, compose, is_pattern, matches

_KEYS: Final = ("as", "share", "take", "common", "frames")
_RATE: Final = re.compile(r"(?P<pattern>.*)@(?P<rate>[0-9]*\.?[0-9]+) ?Hz", re.DOTALL)
_ACTION: Final = "/_action/"


class SharedNames(msgspec.Struct, frozen=True):
    """A pattern of names that leave a robot.

    Attributes:
        pattern: The pattern of global names.
        rate: Largest number of samples per second of each publisher; infinity for no limit.
    """

    pattern: str
    rate: float = math.inf


_ALL: Final = SharedNames("/**")


class FleetPlan(msgspec.Struct, frozen=True, kw_only=True):
    """The names that a robot shares with other machines, and their form there.

    Attributes:
        prefix: The namespace of the robot beyond its machine, such as ``/robot1``.
        share: Names that leave: topics published, services and actions served, parameters.
        take: Patterns of names that come in: topics subscribed to, services and actions called.
        common: Patterns of the names that are the same on both sides.
        frames: Whether the frames of tf get the prefix.
    """

    prefix: str = ""
    share: tuple[SharedNames, ...] = (_ALL,)
    take: tuple[str, ...] = ("/**",)
    common: tuple[str, ...] = ()
    frames: bool = False

    def outside(self, name: str) -> str | None:
        """Return the name beyond the machine of a name on it; ``None`` if it has none."""
        beyond = name if self._is_common(name) else f"{self.prefix}{name}"
        return beyond if self.inside(beyond) == name else None

    def inside(self, name: str) -> str | None:
        """Return the name on the machine of a name beyond it; ``None`` if it has none."""
        if self._is_common(name):
            return name
        return name[len(self.prefix) :] if name.startswith(f"{self.prefix}/") else None

    def shares(self, name: str) -> bool:
        """Tell whether a name on the machine may leave it."""
        return _any_matches(tuple(shared.pattern for shared in self.share), name)

    def takes(self, name: str) -> bool:
        """Tell whether a name on the machine may come in."""
        return _any_matches(self.take, name)

    @property
    def shares_all(self) -> bool:
        """Whether everything leaves."""
        return any(shared.pattern == _ALL.pattern for shared in self.share)

    def rate(self, name: str) -> float:
        """Return the most samples per second of a name; the greatest of all that match it."""
        rates = [shared.rate for shared in self.share if _any_matches((shared.pattern,), name)]
        return max(rates, default=math.inf)

    def _is_common(self, name: str) -> bool:
        return _any_matches(self.common, name)


@lru_cache(maxsize=10_000)
def _any_matches(patterns: tuple[str, ...], name: str) -> bool:
    """Tell whether a pattern matches a name, or the action that the name is a part of."""
    action, _, _ = name.partition(_ACTION)
    return any(matches(pattern, candidate) for pattern in patterns for candidate in {name, action})


def read_share(text: str) -> tuple[SharedNames, ...]:
    """Return the patterns of ``--share``, such as ``/odom,/camera/**@2Hz``.

    Raises:
        UsageError: A part is not a pattern, or its rate is not a number above 0.
    """
    patterns = []
    for part in map(str.strip, text.split(",")):
        shared = _shared(part)
        if shared is None:
            raise UsageError(f"--share has '{part}'; expected such as /odom or /camera/**@2Hz")
        patterns.append(shared)
    return tuple(patterns)


def check_prefix(prefix: str, what: str) -> str:
    """Return a namespace that has to be a global name.

    Raises:
        UsageError: It is none.
    """
    try:
        good = names.is_global(names.check(prefix)) and prefix.strip("/")
    except InvalidName:
        good = ""
    if not good:
        raise UsageError(f"{what} is '{prefix}': expected a namespace such as /robot1")
    return f"/{good}"


def read_plan(text: str, file: str) -> FleetPlan:
    """Parse a ``fleet.yaml``.

    Args:
        text: The text of the file.
        file: The name of the file, for errors.

    Raises:
        YamlError: The text is not YAML, or says something else.
    """
    top = compose(text, file)
    return FleetPlan() if top is None else _PlanReader(file).plan(top)


def _shared(text: str) -> SharedNames | None:
    match = _RATE.fullmatch(text)
    pattern, rate = (match["pattern"], float(match["rate"])) if match else (text, math.inf)
    return SharedNames(pattern, rate) if is_pattern(pattern) and rate > 0 else None


class _PlanReader(PatternReader):
    """Converts the nodes of a YAML document; its errors say where the mistake is."""

    def plan(self, node: yaml.Node) -> FleetPlan:
        plan = FleetPlan()
        for key, value in self.items(node, "what a robot shares"):
            word = str(key.value)
            if word == "as":
                change: dict[str, object] = {"prefix": self._prefix(value)}
            elif word == "share":
                change = {word: tuple(self._share(*part) for part in self.listed(value))}
            elif word in {"take", "common"}:
                change = {word: tuple(self.pattern(*part) for part in self.listed(value))}
            elif word == "frames":
                change = {word: self.flag(value)}
            else:
                hint = f"{near_miss(word, _KEYS)}; expected one of {', '.join(_KEYS)}"
                raise self.error(key, f"'{word}' is not known{hint}")
            plan = msgspec.structs.replace(plan, **change)
        return plan

    def _prefix(self, node: yaml.Node) -> str:
        texts: Sequence[str] = [text for _, text in self.listed(node)]
        try:
            return check_prefix(", ".join(texts), "'as'")
        except UsageError as error:
            raise self.error(node, str(error)) from error

    def _share(self, node: yaml.Node, text: str) -> SharedNames:
        shared = _shared(text)
        if shared is None:
            raise self.error(
                node, f"'{text}' is not a pattern; expected one like /odom or /camera/**@2Hz"
            )
        return shared
