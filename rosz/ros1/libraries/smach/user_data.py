"""smach.user_data: values that the states of a container share."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from copy import copy
from typing import Any

from rosz.ros1.libraries.smach.util import InvalidUserCodeError, logerr


class _Values:
    """Values by key; each key that does not begin with ``_`` is an attribute, too."""

    def __getitem__(self, key: str) -> Any:
        raise NotImplementedError

    def __setitem__(self, key: str, item: Any) -> None:
        raise NotImplementedError

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # of Python, such as __deepcopy__
            raise AttributeError(name)
        return self[name]

    def __setattr__(self, name: str, value: Any) -> None:
        if name.startswith("_"):
            object.__setattr__(self, name, value)
        else:
            self[name] = value


class UserData(_Values):
    """Values by key; each key is an attribute, too."""

    def __init__(self) -> None:
        self._data: dict[str, Any] = {}

    def update(self, other_userdata: UserData) -> None:
        """Take over all values of other user data."""
        self._data.update(other_userdata._data)

    def extract(self, keys: Iterable[str], remapping: Mapping[str, str]) -> UserData:
        """Return copies of some values, as a state with a remapping sees them.

        Args:
            keys: Keys to copy.
            remapping: For keys of the result, the keys here.
        """
        names = {here: there for there, here in remapping.items()}
        if len(names) != len(remapping):
            logerr(f"a remapping of user data gives two keys to one value: {dict(remapping)}")
        extracted = UserData()
        for key in keys:
            extracted[names.get(key, key)] = copy(self[key])
        return extracted

    def merge(self, ud: Any, keys: Iterable[str], remapping: Mapping[str, str]) -> None:
        """Copy some values of other user data into this.

        Args:
            ud: User data to copy from.
            keys: Keys to copy.
            remapping: For keys there, the keys here.
        """
        for key in keys:
            self[remapping.get(key, key)] = copy(ud[key])

    def keys(self) -> list[str]:
        """Return all keys."""
        return list(self._data)

    def __getitem__(self, key: str) -> Any:
        try:
            return self._data[key]
        except KeyError:
            logerr(f"Userdata key '{key}' not available. Available keys are: {self.keys()}")
            raise

    def __setitem__(self, key: str, item: Any) -> None:
        self._data[key] = item

    def __contains__(self, key: object) -> bool:
        return key in self._data


def get_const(obj: Any) -> Any:
    """Return a view of an object that can be read only; values without attributes as they are."""
    return Const(obj) if hasattr(obj, "__dict__") else obj


class Const:
    """A view of an object; a state gets it for a key that it does not write.

    Attributes that the state sets stay in the view; the object does not change.

    Args:
        obj: The object.
    """

    def __init__(self, obj: Any) -> None:
        self._obj = obj

    def __getattr__(self, name: str) -> Any:
        if name == "_obj":  # not set while it is copied
            raise AttributeError(name)
        return get_const(getattr(self._obj, name))

    def __getitem__(self, name: Any) -> Any:
        return get_const(self._obj[name])

    def __delattr__(self, name: str) -> None:
        text = f"cannot delete '{name}': the state does not declare its key as an output key"
        logerr(text)
        raise TypeError(text)


class Remapper(_Values):
    """User data as a state sees it: the keys that it declares, under its own names.

    Args:
        ud: The user data.
        input_keys: Keys that can be read.
        output_keys: Keys that can be written.
        remapping: For keys of the state, the keys of the user data.
    """

    def __init__(
        self,
        ud: Any,
        input_keys: Collection[str] = (),
        output_keys: Collection[str] = (),
        remapping: Mapping[str, str] | None = None,
    ) -> None:
        self._ud, self._map = ud, remapping or {}
        self._input, self._output = input_keys, output_keys

    def _remap(self, key: str) -> str:
        return self._map.get(key, key)

    def update(self, other_userdata: UserData) -> None:
        """Take over all values of other user data."""
        self._ud.update(other_userdata)

    def keys(self) -> list[str]:
        """Return the keys of the user data that can be read."""
        return [self._remap(key) for key in self._ud.keys() if key in self._input]  # noqa: SIM118

    def __getitem__(self, key: str) -> Any:
        if key not in self._input:
            raise InvalidUserCodeError(
                f"cannot read '{key}' of the user data: the state declares only the input keys"
                f" {sorted(self._input)}"
            )
        value = self._ud[self._remap(key)]
        return value if key in self._output else get_const(value)

    def __setitem__(self, key: str, item: Any) -> None:
        if key in self._output:
            self._ud[self._remap(key)] = item
        else:
            logerr(
                f"cannot write '{key}' of the user data: the state declares only the output keys"
                f" {sorted(self._output)}"
            )

    def __contains__(self, key: object) -> bool:
        return isinstance(key, str) and key in self._input and self._remap(key) in self._ud
