"""rosbag.migration: messages of older definitions as those of the types here.

A `MessageMigrator` knows rules, from files and from packages that export them. The path from a type
in a bag to the type here is made of these, joined by rules that are written from the definitions
where all fields fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rosz.ros1.genpy import get_message_class
from rosz.ros1.rosbag.bag import Bag
from rosz.ros1.rosbag.rule import (
    BagMigrationException,
    MessageUpdateRule,
    clean_name,
    constants_from_def,
    get_message_key,
    get_path_key,
    migration_default_value,
    qualified_name,
    warn,
    write_half_rule,
    write_rule,
)
from rosz.ros1.rospkg import InvalidManifest, ResourceNotFound, RosPack

__all__ = (
    "BagMigrationException",
    "MessageMigrator",
    "MessageUpdateRule",
    "RuleChain",
    "ScaffoldNode",
    "checkbag",
    "checkmessages",
    "clean_name",
    "constants_from_def",
    "fixbag",
    "fixbag2",
    "get_message_key",
    "get_path_key",
    "migration_default_value",
    "qualified_name",
)

_EXPORTS = (
    ("rosbagmigration", "rule_file"),
    ("rosbag", "migration_rule_file"),
    ("rosbag_migration_rule", "rule_file"),
)

Checked = list[tuple[list["ScaffoldNode"], list[MessageUpdateRule]]]
"""For each type that needs rules: the path, and the rules in it that are not valid."""


class RuleChain:
    """The rules of an old type.

    Attributes:
        chain: Rules that keep the name, by their order.
        order_keys: Their orders.
        rename: The rule that gives another name.
    """

    def __init__(self) -> None:
        self.chain: list[MessageUpdateRule] = []
        self.order_keys: set[int] = set()
        self.rename: MessageUpdateRule | None = None

    @property
    def rules(self) -> list[MessageUpdateRule]:
        """All rules in their order."""
        return [*self.chain, *([self.rename] if self.rename is not None else [])]


class ScaffoldNode:
    """A step of a path.

    Attributes:
        old_class: Class of the messages before it.
        new_class: Class of the messages behind it; None if it is not known.
        rule: The rule.
    """

    def __init__(self, old_class: Any, new_class: Any, rule: MessageUpdateRule) -> None:
        self.old_class = old_class
        self.new_class = new_class
        self.rule = rule


class MessageMigrator:
    """Migrates messages by rules.

    Args:
        input_rule_files: Paths of files with rules.
        plugins: Whether to read the files that packages export too.

    Attributes:
        rulechains: The rules by old type.
        rename_map: The names that each type has had, by old type.

    Raises:
        BagMigrationException: A rule says that it is not valid.
    """

    def __init__(self, input_rule_files: Sequence[str] = (), plugins: bool = True) -> None:
        self.rulechains: dict[str, RuleChain] = {}
        self.rename_map: dict[str, set[str]] = {}
        self.found_paths: dict[Any, list[ScaffoldNode]] = {}
        self.found_targets: dict[Any, Any] = {}
        self.false_rule_loaded = False
        self._nodes: list[ScaffoldNode] = []
        for file in input_rule_files:
            self._load(Path(file), "")
        if plugins:
            self._load_plugins()
        if self.false_rule_loaded:
            raise BagMigrationException("the migrator has rules that are not valid")
        for name in self.rulechains:
            self.rename_map[name] = {name, *(rule.new_type for rule in self._renames(name))}
        for chain in list(self.rulechains.values()):
            first = chain.rules[0].old_class
            self.find_path(first, self.find_target(first))

    def _load_plugins(self) -> None:
        packages = RosPack()
        for package in packages.list():
            try:
                manifest = packages.get_manifest(package)
            except (InvalidManifest, ResourceNotFound):
                continue  # of an unrelated package
            needed = {one.name for one in manifest.depends}
            for tag, attribute in _EXPORTS:
                for file in manifest.get_export(tag, attribute) if tag in needed else ():
                    self._load(Path(packages.get_path(package)) / file, package)

    def _load(self, file: Path, package: str) -> None:
        """Load a file of rules, which is Python; what is wrong with it is told."""
        space: dict[str, Any] = {"MessageUpdateRule": MessageUpdateRule}
        try:
            code = compile(file.read_text(encoding="utf-8"), str(file), "exec")
            exec(code, space)  # noqa: S102  # rules are programs
        except Exception as error:  # noqa: BLE001  # the file is the user's
            place = f"in package [{package}]" if package else "in local package"
            warn(f"Cannot load rule file [{file}] {place}: {type(error).__name__}: {error}")
            return
        for name, value in space.items():
            if (
                isinstance(value, type)
                and issubclass(value, MessageUpdateRule)
                and value is not MessageUpdateRule
            ):
                self.add_update_rule(value(self, f"{file}:{name}"))

    def add_update_rule(self, r: MessageUpdateRule) -> None:
        """Add a rule; one that contradicts an earlier one is left out with a warning."""
        if not r.valid:
            warn(f"ERROR: rule [{r.location}] has valid set to False")
            self.false_rule_loaded = True
            return
        if r.old_class is None or r.new_class is None:
            return  # its definition is not well-formed, which has been told
        chain = self.rulechains.setdefault(r.old_type, RuleChain())
        reason = self._contradiction(r, chain)
        if reason:
            warn(f"WARNING: update rule [{r.location}] is ignored: {reason}")
        elif r.rename_rule:
            chain.rename = r
        else:
            chain.order_keys.add(r.order)
            chain.chain.append(r)
            chain.chain.sort(key=lambda one: one.order)
        if not chain.rules:
            del self.rulechains[r.old_type]

    def _contradiction(self, rule: MessageUpdateRule, chain: RuleChain) -> str:
        rename = chain.rename
        if not rule.rename_rule:
            if rule.order in chain.order_keys:
                return f"another rule of type [{rule.old_type}] has order {rule.order}"
            late = rename is not None and rule.order >= rename.order
            return f"its order is not below that of [{rename.location}]" if rename and late else ""
        if rename is not None:
            return f"[{rename.location}] renames type [{rule.old_type}] too"
        if chain.chain and rule.order <= chain.chain[-1].order:
            return "it renames, and its order is not the largest one"
        names = [rule.new_type, *(one.new_type for one in self._renames(rule.new_type))]
        return f"type [{rule.old_type}] gets its name back" if rule.old_type in names else ""

    def _renames(self, name: str) -> list[MessageUpdateRule]:
        """Return the rules that rename a type, one behind the other."""
        found: list[MessageUpdateRule] = []
        while name in self.rulechains:
            rule = self.rulechains[name].rename
            if rule is None or rule in found:
                break
            found.append(rule)
            name = rule.new_type
        return found

    # What is known.

    def lookup_type(self, key: tuple[str, str]) -> Any:
        """Return the class of a type and an MD5 sum in the rules; None if there is none."""
        return self.class_dict.get(key)

    @property
    def class_dict(self) -> dict[Any, Any]:
        """The classes in all rules by their keys."""
        classes = [one for node in self._nodes for one in (node.old_class, node.new_class)]
        return {get_message_key(one): one for one in classes}

    def all_rules_valid(self) -> bool:
        """Return whether no rule is missing."""
        return all(node.rule.valid for node in self._nodes)

    def get_invalid_rules(self) -> list[MessageUpdateRule]:
        """Return the rules that are missing, as they were written from the definitions."""
        return self.filter_rules_unique([n.rule for n in self._nodes if not n.rule.valid])

    def filter_rules_unique(self, rules: Sequence[MessageUpdateRule]) -> list[MessageUpdateRule]:
        """Return the rules, each pair of classes once."""
        found = {get_path_key(rule.old_class, rule.new_class): rule for rule in reversed(rules)}
        return list(reversed(found.values()))

    def expand_rules(self, rules: Sequence[MessageUpdateRule]) -> list[MessageUpdateRule]:
        """Return the rules, and those that they need for the types in their messages."""
        found = []
        for rule in self.filter_rules_unique(rules):
            found += [rule, *self.expand_rules(rule.sub_rules)]
        return self.filter_rules_unique(found)

    def find_target(self, old_class: Any) -> Any:
        """Return the class here that a class becomes; None if there is none."""
        key = get_message_key(old_class)
        if key not in self.found_targets:
            names = [rule.new_type for rule in reversed(self._renames(old_class._type))]
            known = (get_message_class(name) for name in [old_class._type, *names[:1]])
            self.found_targets[key] = next((one for one in known if one is not None), None)
        return self.found_targets[key]

    # Paths.

    def find_path(self, old_class: Any, new_class: Any) -> list[ScaffoldNode]:
        """Return the steps from one class to another one; empty for the same definition.

        Rules that are missing are in it, and not valid. Without a new class the last step leads
        nowhere.
        """
        key = get_path_key(old_class, new_class)
        if key not in self.found_paths:
            if key[0] == key[1]:
                self.found_paths[key] = []
            else:
                self.found_paths[key] = self._find_path(old_class, new_class)
        return self.found_paths[key]

    def _find_path(self, old: Any, new: Any) -> list[ScaffoldNode]:
        route = self._route(old._type, None if new is None else new._type)
        begun = self._begin(old, new, route)
        if begun and new is not None and begun[-1].new_class is new:
            return begun
        last = begun[-1].new_class if begun else old
        if new is None:
            return [*begun, self._node(last, None, write_half_rule(last))]
        return [*begun, *self._end(last, new)]

    def _route(self, name: str, target: str | None) -> list[MessageUpdateRule]:
        """Return the rules of a type, and of those that it has become, up to a type."""
        found: list[MessageUpdateRule] = []
        chain = self.rulechains.get(name)
        while chain is not None:
            entry = 0
            if found:
                entry = self._entry(found[-1].new_class, chain.chain)
            found += chain.chain[entry:]
            if chain.rename is None or name == target:
                break
            found.append(chain.rename)
            name = chain.rename.new_type
            chain = self.rulechains.get(name)
        return found

    def _entry(self, cls: Any, rules: Sequence[MessageUpdateRule]) -> int:
        """Return the index of the last rule that a class leads to."""
        keys = [get_message_key(rule.old_class) for rule in rules]
        if get_message_key(cls) in keys:
            return len(keys) - 1 - keys[::-1].index(get_message_key(cls))
        fitting = [
            index for index, rule in enumerate(rules) if self._written(cls, rule.old_class).valid
        ]
        return fitting[-1] if fitting else len(rules)

    def _begin(self, old: Any, new: Any, route: list[MessageUpdateRule]) -> list[ScaffoldNode]:
        """Return the steps by the rules of a route that a class leads to."""
        if not route or get_message_key(route[-1].new_class) == get_message_key(old):
            return []
        keys = [get_message_key(rule.old_class) for rule in route]
        own = [index for index, key in enumerate(keys) if key == get_message_key(old)]
        if own:
            return self._joined(route[own[-1] :], new)
        direct = None if new is None else self._written(old, new)
        if direct is not None and self._is_usable(direct):
            return [self._node(old, new, direct)]
        for index in reversed(range(len(route))):
            if route[index].old_type == old._type:
                rule = self._written(old, route[index].old_class)
                if self._is_usable(rule):
                    first = self._node(old, rule.new_class, rule)
                    return [first, *self._joined(route[index:], new)]
        rule = self._written(old, route[0].old_class)
        return [self._node(old, rule.new_class, rule), *self._joined(route, new)]

    def _joined(self, route: Sequence[MessageUpdateRule], new: Any) -> list[ScaffoldNode]:
        """Return the steps by some rules, with written ones between them where they do not meet."""
        found: list[ScaffoldNode] = []
        for rule in route:
            if found:
                last = found[-1].new_class
                if get_message_key(last) == get_message_key(new):
                    break
                if get_message_key(last) != get_message_key(rule.old_class):
                    written = self._written(last, rule.old_class)
                    found.append(self._node(last, rule.old_class, written))
            found.append(self._node(rule.old_class, rule.new_class, rule))
        return found

    def _end(self, last: Any, new: Any) -> list[ScaffoldNode]:
        if get_message_key(last) == get_message_key(new):
            return []
        return [self._node(last, new, self._written(last, new))]

    def _written(self, old: Any, new: Any) -> MessageUpdateRule:
        rule = self.make_update_rule(old, new)
        made = rule(self, f"GENERATED.{rule.__name__}")
        made.old_class, made.new_class = old, new
        return made

    def _is_usable(self, rule: MessageUpdateRule) -> bool:
        if not rule.valid:
            return False
        if not rule.sub_rules_done:
            rule.find_sub_paths()
        return rule.sub_rules_valid

    def _node(
        self, old: Any, new: Any, rule: MessageUpdateRule | type[MessageUpdateRule]
    ) -> ScaffoldNode:
        made = (
            rule
            if isinstance(rule, MessageUpdateRule)
            else rule(self, f"GENERATED.{rule.__name__}")
        )
        if not made.sub_rules_done:
            made.find_sub_paths()
        node = ScaffoldNode(old, new, made)
        self._nodes.append(node)
        return node

    def make_update_rule(self, old_class: Any, new_class: Any) -> type[MessageUpdateRule]:
        """Return a rule that copies what both classes have; valid if that is everything."""
        return write_rule(old_class, new_class, self.rename_map)

    def make_old_half_rule(self, old_class: Any) -> type[MessageUpdateRule]:
        """Return an invalid rule for messages whose new type is not known."""
        return write_half_rule(old_class)

    # Messages.

    def migrate_raw(self, msg_from: Any, msg_to: Any) -> tuple[Any, ...]:
        """Return a raw message, as ``Bag.read_messages(raw=True)`` has it, of another class.

        Args:
            msg_from: The message: type, bytes, MD5 sum, position, class.
            msg_to: The same for the new class; its bytes are ignored.

        Raises:
            BagMigrationException: A rule is missing.
        """
        path = self._valid_path(msg_from[4], msg_to[4])
        data = msg_from[1]
        if path and msg_from[2] != msg_to[2]:
            data = _follow(path, path[0].old_class.from_ros1(data)).to_ros1()
        return (msg_to[0], data, *msg_to[2:])

    def migrate(self, msg_from: Any, msg_to: Any) -> None:
        """Fill a message from one of another class.

        Raises:
            BagMigrationException: A rule is missing.
        """
        path = self._valid_path(type(msg_from), type(msg_to))
        done = msg_from
        if path and msg_from._md5sum != msg_to._md5sum:
            done = _follow(path, path[0].old_class.from_ros1(msg_from.to_ros1()))
        msg_to.deserialize(done.to_ros1())

    def migrate_array(self, msg_from_array: Sequence[Any], msg_to_array: Sequence[Any]) -> None:
        """Fill messages from those of another class, as many.

        Raises:
            BagMigrationException: The numbers differ, or a rule is missing.
        """
        if len(msg_from_array) != len(msg_to_array):
            raise BagMigrationException(
                f"{len(msg_from_array)} messages cannot become {len(msg_to_array)}"
            )
        for one, other in zip(msg_from_array, msg_to_array, strict=True):
            self.migrate(one, other)

    def _valid_path(self, old: Any, new: Any) -> list[ScaffoldNode]:
        path = self.find_path(old, new)
        if not all(node.rule.valid for node in path):
            raise BagMigrationException(
                f"there are no valid rules from [{old._type}] to [{new._type}]"
            )
        return path


def _follow(path: Sequence[ScaffoldNode], message: Any) -> Any:
    for node in path:
        message = node.rule.apply(message)
    return message


# Bags.


def checkmessages(migrator: MessageMigrator, messages: Sequence[Any]) -> Checked:
    """Return the paths of classes that need rules, and the rules in them that are not valid."""
    found: Checked = []
    checked = set()
    for cls in messages:
        key = get_message_key(cls)
        if key in checked:
            continue
        checked.add(key)
        path = migrator.find_path(cls, migrator.find_target(cls))
        if path:
            rules = migrator.expand_rules([node.rule for node in path])
            found.append((path, [rule for rule in rules if not rule.valid]))
    return found


def checkbag(migrator: MessageMigrator, inbag: str) -> Checked:
    """Return the paths of the types in a bag that need rules, and the rules that are not valid.

    Raises:
        ROSBagException: The bag cannot be read.
    """
    with Bag(inbag) as bag:
        classes = {id(message[4]): message[4] for _, message, _ in bag.read_messages(raw=True)}
    return checkmessages(migrator, list(classes.values()))


def fixbag(migrator: MessageMigrator, inbag: str, outbag: str) -> bool:
    """Write a bag with messages of the types here.

    Returns:
        Whether all rules were there; without them nothing is written.

    Raises:
        ROSBagException: A bag cannot be read or written.
    """
    return not fixbag2(migrator, inbag, outbag)


def fixbag2(migrator: MessageMigrator, inbag: str, outbag: str, force: bool = False) -> Checked:
    """Write a bag with messages of the types here.

    Args:
        migrator: The migrator.
        inbag: Path of the bag.
        outbag: Path of the new one.
        force: Whether it is written although rules are missing; such messages stay as they are.

    Returns:
        The paths whose rules are missing, unless it was forced; then nothing is written.

    Raises:
        ROSBagException: A bag cannot be read or written.
    """
    missing = [one for one in checkbag(migrator, inbag) if one[1]]
    if missing and not force:
        return missing
    refused = {get_message_key(path[0].old_class) for path, _ in missing}
    with Bag(inbag) as bag, Bag(outbag, "w", options=bag.options) as made:
        rows = bag.read_messages(raw=True, return_connection_header=True)
        for topic, message, stamp, header in rows:
            cls = migrator.find_target(message[4])
            written = message
            if cls is not None and get_message_key(message[4]) not in refused:
                written = migrator.migrate_raw(message, (cls._type, None, cls._md5sum, None, cls))
            made.write(topic, written, stamp, raw=True, connection_header=header)
    return []
