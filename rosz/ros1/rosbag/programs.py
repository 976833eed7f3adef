"""The programs of ROS 1's package rosbag that migrate bags: ``fixbag.py`` and its companions.

Their words and output are those of ROS 1.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rosz.errors import RoszError
from rosz.ros1.genpy import generate_dynamic, get_message_class
from rosz.ros1.rosbag.bag import Bag
from rosz.ros1.rosbag.exceptions import ROSBagException
from rosz.ros1.rosbag.migration import (
    BagMigrationException,
    MessageMigrator,
    MessageUpdateRule,
    checkmessages,
    fixbag,
)

__all__ = ("run_fixbag", "run_fixbag_batch", "run_makerule", "run_savemsg")

_FEWEST = 2
_TYPE_LINE = re.compile(r"\[(.*)\]:")
_Failed = (BagMigrationException, ROSBagException, OSError, RoszError, ValueError)


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")


def _fail(error: object) -> int:
    sys.stderr.write(f"ERROR: {error}\n")
    return 1


def run_fixbag(words: Sequence[str]) -> int:
    """Run ``fixbag.py INBAG OUTBAG [RULEFILE ...]``; return the exit code."""
    if len(words) < _FEWEST:
        _say("usage: fixbag.py <inbag> <outbag> [rulefile1, rulefile2, ...]")
        return 2
    if words[1].endswith(".bmr"):
        sys.stderr.write("Second argument should be a bag, not a rule file.\n")
        return 2
    try:
        done = fixbag(MessageMigrator(words[2:]), words[0], words[1])
    except _Failed as error:
        return _fail(error)
    _say("Bag migrated successfully." if done else "Bag could not be migrated.")
    return 0 if done else 1


def run_fixbag_batch(words: Sequence[str]) -> int:
    """Run ``fixbag_batch.py BAG ...``; return the exit code."""
    if not words:
        _say("usage: fixbag_batch.py bag1 [bag2 bag3 ...]")
        return 2
    migrator = MessageMigrator()
    code = 0
    for word in words:
        _say(f"Trying to migrate: {word}")
        bag, made = Path(word), Path(f"{word}.tmp")
        try:
            done = fixbag(migrator, str(bag), str(made))
        except _Failed as error:
            code = _fail(error)
            continue
        if not done:
            _say(" Migration failed.")
            code = 1
            continue
        old = Path(f"{word}.old")
        number = 1
        while old.is_file():
            number += 1
            old = Path(f"{word}.old{number}")
        bag.rename(old)
        made.rename(bag)
        _say(f" Migration successful.  Original stored as: {old}")
    return code


def run_savemsg(words: Sequence[str]) -> int:
    """Run ``savemsg.py [-b BAG] TYPE``; return the exit code."""
    parser = argparse.ArgumentParser(prog="savemsg.py")
    parser.add_argument("-b", "--bagfiles", metavar="BAG", help="take the type from a bag")
    parser.add_argument("type")
    given = parser.parse_args(words)
    try:
        found = _in_bag(given.bagfiles, given.type) if given.bagfiles else _known(given.type)
    except _Failed as error:
        return _fail(error)
    if found is None:
        place = f" in bag {given.bagfiles}" if given.bagfiles else ""
        return _fail(f"could not find message {given.type}{place}")
    _say(f"[{given.type}]:\n{found}")
    return 0


def _known(name: str) -> str | None:
    cls = get_message_class(name)
    return None if cls is None else cls._full_text


def _in_bag(path: str, name: str) -> str | None:
    with Bag(path) as bag:
        rows = bag.read_messages(raw=True, return_connection_header=True)
        for _, message, _, header in rows:
            if message[0] == name:
                text: str = header["message_definition"].decode()
                return text
    return None


def run_makerule(words: Sequence[str]) -> int:
    """Run ``makerule.py SAVED [-a] RULEFILE [RULEFILE ...] [-n]``; return the exit code."""
    parser = argparse.ArgumentParser(prog="makerule.py")
    parser.add_argument("-a", "--append", action="store_true", help="add to RULEFILE")
    parser.add_argument("-n", "--noplugins", action="store_true", help="leave out packages' rules")
    parser.add_argument("saved", help="what savemsg.py printed")
    parser.add_argument("rulefile")
    parser.add_argument("rules", nargs="*")
    given = parser.parse_intermixed_args(words)
    target = Path(given.rulefile)
    if target.is_file() != given.append:
        state = (
            "does not exist, and so -a is invalid" if given.append else "already exists; -a adds"
        )
        return _fail(f"the file {target} {state}")
    try:
        old = _saved(Path(given.saved))
        extra = [str(target)] if given.append else []
        migrator = MessageMigrator([*given.rules, *extra], not given.noplugins)
        migrations = checkmessages(migrator, [old])
    except _Failed as error:
        return _fail(error)
    if not migrations:
        _say("Saved definition is up to date.")
        return 0
    _say("The following migrations need to occur:")
    missing: list[MessageUpdateRule] = []
    for path, rules in migrations:
        _describe(path[0].old_class, path[-1].new_class, 0)
        if rules:
            _say(f"    {len(rules)} rules missing:")
        for rule in rules:
            _describe(rule.old_class, rule.new_class, 1)
        missing += rules
    return _write(target, migrator, migrator.filter_rules_unique(missing))


def _saved(path: Path) -> Any:
    first, _, text = path.read_text(encoding="utf-8").partition("\n")
    match = _TYPE_LINE.match(first)
    if match is None:
        raise BagMigrationException(f"{path}: the first line should be '[my_package/my_msg]:'")
    return generate_dynamic(match[1], text)[match[1]]


def _describe(old: Any, new: Any, depth: int) -> None:
    indent = "    " * depth
    _say(f"{indent} * From: {old._type} [{old._md5sum}]")
    _say(f"{indent}   To:   {f'{new._type} [{new._md5sum}]' if new is not None else 'Unknown'}")


def _write(target: Path, migrator: MessageMigrator, rules: list[MessageUpdateRule]) -> int:
    """Write the rules that are missing; ask for the new names of types that have moved."""
    if not rules:
        _say(f"\nNo additional rule files needed to be generated.  {target} not created.")
        return 0
    text = ""
    while rules:
        more: list[MessageUpdateRule] = []
        for rule in rules:
            if rule.new_class is not None:
                text += rule.get_class_def() or ""
                continue
            made = _moved(migrator, rule)
            if made is None:
                return 1
            more += [one for one in migrator.expand_rules(made.sub_rules) if not one.valid]
            text += made.get_class_def() or ""
        rules = migrator.filter_rules_unique(more)
    try:
        with target.open("a", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        return _fail(error)
    _say(f"\nThe necessary rule files have been written to: {target}")
    return 0


def _moved(migrator: MessageMigrator, rule: MessageUpdateRule) -> MessageUpdateRule | None:
    name = rule.old_class._type
    _say(f"The message type {name} appears to have moved.  Please enter the type to migrate it to.")
    while True:
        sys.stdout.write(">")
        sys.stdout.flush()
        line = sys.stdin.readline()
        if not line:
            _fail("no type was entered")
            return None
        cls = get_message_class(line.strip()) if "/" in line else None
        if cls is not None:
            break
        _say(f"'{line.strip()}' could not be found in your system.  Please make sure it is built.")
    made = migrator.make_update_rule(rule.old_class, cls)
    found = made(migrator, f"GENERATED.{made.__name__}")
    found.find_sub_paths()
    return found
