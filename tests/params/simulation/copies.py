"""Copies of processes, quicker than `copy.deepcopy`, and a form that tells which are alike."""

from __future__ import annotations

import enum
import itertools
import types
from collections.abc import Callable
from typing import Any, Final

import msgspec

from rosz.params.history import History
from rosz.params.replica.core.work import Work
from rosz.params.writes import Write

_Cloner = Callable[[Any, dict[int, Any]], Any]

_SHARED: Final = frozenset({"root", "shown", "mark", "held", "random", "config", "member"})
"""Attributes that are replaced and never changed in place."""

_FLAT: Final = frozenset(
    {"_buckets", "_toggled", "_deletions", "ever", "gone", "members", "lost", "seen"}
)
"""Attributes with collections of what never changes."""

_IGNORED: Final = frozenset(
    {
        *("shown", "mark", "held", "gone", "random", "config", "now", "effects", "root"),
        *("_numbers", "_buckets", "_toggled", "_handlers", "_timers", "deadline", "member"),
        *("_count", "origin", "woke_at", "stopped_at"),
    }
)
"""Attributes that follow from others, or that say nothing about what happens next."""


_NUMBERED: Final = frozenset({"queries", "_queries"})
_FIXED: Final = frozenset({int, float, bool, str, bytes, tuple, frozenset, type(None), Write})
"""Types of what never changes, unless a tuple holds what does; such tuples are not used."""

_PLAIN: Final = frozenset({int, float, bool, str, bytes, type(None)})
"""Types of what has itself as its form."""


def clone(thing: Any, memo: dict[int, Any]) -> Any:
    """Return a copy that shares with the original only what never changes."""
    kind = type(thing)
    try:
        cloner = _CLONERS[kind]
    except KeyError:
        cloner = _CLONERS[kind] = _cloner_of(kind)
    return thing if cloner is None else cloner(thing, memo)


def _clone_values(values: dict[Any, Any], memo: dict[int, Any]) -> dict[Any, Any]:
    made = values.copy()
    for key, value in values.items():
        if type(value) not in _FIXED:
            made[key] = clone(value, memo)
    return made


def _clone_dict(thing: dict[Any, Any], memo: dict[int, Any]) -> Any:
    made = memo.get(id(thing))
    if made is None:
        made = memo[id(thing)] = _clone_values(thing, memo)
    return made


def _clone_list(thing: list[Any], memo: dict[int, Any]) -> Any:
    made = memo.get(id(thing))
    if made is None:
        made = memo[id(thing)] = [clone(value, memo) for value in thing]
    return made


def _clone_set(thing: set[Any], memo: dict[int, Any]) -> Any:
    made = memo.get(id(thing))
    if made is None:
        made = memo[id(thing)] = thing.copy()
    return made


def _clone_count(thing: Any, _: dict[int, Any]) -> Any:
    return itertools.count(int(repr(thing)[6:-1]))


def _clone_method(thing: types.MethodType, memo: dict[int, Any]) -> Any:
    return types.MethodType(thing.__func__, clone(thing.__self__, memo))


def _clone_struct(thing: Any, memo: dict[int, Any]) -> Any:
    made = memo.get(id(thing))
    if made is None:
        fields = [clone(getattr(thing, name), memo) for name in thing.__struct_fields__]
        made = memo[id(thing)] = type(thing)(*fields)
    return made


def _clone_slots(thing: Any, memo: dict[int, Any]) -> Any:
    made = memo.get(id(thing))
    if made is None:
        made = memo[id(thing)] = object.__new__(type(thing))
        for name in type(thing).__slots__:
            setattr(made, name, clone(getattr(thing, name), memo))
    return made


def _clone_object(thing: Any, memo: dict[int, Any]) -> Any:
    made = memo.get(id(thing))
    if made is None:
        made = memo[id(thing)] = object.__new__(type(thing))
        target = made.__dict__
        target.update(thing.__dict__)
        for name, value in thing.__dict__.items():
            if type(value) in _FIXED or name in _SHARED:
                continue
            target[name] = value.copy() if name in _FLAT else clone(value, memo)
    return made


def _cloner_of(kind: Any) -> _Cloner | None:
    """Return how to copy things of a kind; ``None`` if they never change."""
    if issubclass(kind, msgspec.Struct):
        # Messages are made, and not changed afterwards.
        fixed = kind.__struct_config__.frozen or kind.__module__ == "rosz.params.wire"
        return None if fixed else _clone_struct
    if issubclass(kind, (enum.Enum, tuple)) or kind.__module__ == "builtins":
        return None
    return _clone_slots if "__slots__" in kind.__dict__ else _clone_object


_CLONERS: dict[type, _Cloner | None] = {
    dict: _clone_dict,
    list: _clone_list,
    set: _clone_set,
    itertools.count: _clone_count,
    types.MethodType: _clone_method,
}


class Form:
    """The form of a process or a message, which tells which are alike."""

    def __init__(self) -> None:
        self._met: dict[int, int] = {}

    def of(self, thing: Any) -> Any:
        """Return a hashable value that is equal for things that are alike."""
        kind = type(thing)
        try:
            form = _FORMS[kind]
        except KeyError:
            form = _FORMS[kind] = _form_of(kind)
        return form(self, thing)

    def of_list(self, things: Any) -> Any:
        """Return the form of things in an order."""
        return tuple([thing if type(thing) in _PLAIN else self.of(thing) for thing in things])

    def of_set(self, things: Any) -> Any:
        """Return the form of things without an order."""
        return frozenset([thing if type(thing) in _PLAIN else self.of(thing) for thing in things])

    def of_dict(self, things: Any) -> Any:
        """Return the form of a dict."""
        of = self.of
        return frozenset(
            [
                (
                    key if type(key) in _PLAIN else of(key),
                    value if type(value) in _PLAIN else of(value),
                )
                for key, value in things.items()
            ]
        )

    def of_history(self, thing: History) -> Any:
        """Return the form of a set of writes."""
        return self.of_set(thing.writes()), thing.horizon, thing.latest

    def of_object(self, thing: Any) -> Any:
        """Return the form of an object; of one that was met, its number."""
        if id(thing) in self._met:
            return self._met[id(thing)]
        self._met[id(thing)] = len(self._met)
        form: list[Any] = []
        for name, value in thing.__dict__.items():
            if name in _IGNORED:
                continue
            if type(value) in _PLAIN:
                form.append(value)
            elif name in _NUMBERED:
                # Queries are alike whatever their numbers; those on their way have others.
                form.append(self.of([value[key] for key in sorted(value)]))
            else:
                form.append(self.of(value))
        return tuple(form)


def _form_of(kind: Any) -> Callable[[Form, Any], Any]:
    """Return how to get the form of things of a kind."""
    if issubclass(kind, msgspec.Struct):
        names = [name for name in kind.__struct_fields__ if name not in _IGNORED]
        return lambda form, thing: form.of_list([getattr(thing, name) for name in names])
    if issubclass(kind, tuple):
        return Form.of_list
    if issubclass(kind, enum.Enum):
        return lambda _, thing: thing.name
    if kind is Work or kind in (types.MethodType, types.FunctionType, itertools.count):
        return lambda *_: None
    return Form.of_object if kind.__module__ != "builtins" else lambda _, thing: thing


_FORMS: Final[dict[type, Callable[[Form, Any], Any]]] = {
    list: Form.of_list,
    tuple: Form.of_list,
    set: Form.of_set,
    frozenset: Form.of_set,
    dict: Form.of_dict,
    History: Form.of_history,
    Write: lambda _, write: (write.path, write.time, write.clock),
}
