"""``rosz bag info``."""

from __future__ import annotations

from typing import Annotated, Any

from rosz.cli import suggest
from rosz.cli.bag.source import app
from rosz.cli.console import print_error, print_json, print_lines, warn
from rosz.cli.declare import Argument, Json, Option
from rosz.errors import BagError, UsageError, near_miss


@app.command("info")
def info_command(
    bags: Annotated[list[str], Argument("BAG", source=suggest.files)],
    *,
    as_yaml: Annotated[bool, Option("-y --yaml", "Print YAML.")] = False,
    key: Annotated[str, Option("-k --key KEY", "Print one value of the YAML.")] = "",
    freq: Annotated[bool, Option("--freq", "Also find how often messages came.")] = False,
    json: Json = False,
) -> int:
    """Print what is in bags."""
    if key and not as_yaml:
        raise UsageError("-k prints one value of YAML: give -y too")
    from rosz.bags import format_summary, format_yaml, open_reader, summarize

    code = 0
    rows = []
    for number, bag in enumerate(bags):
        try:
            with open_reader(bag) as reader:
                summary = summarize(bag, reader, frequencies=freq)
                problems = list(reader.problems)
        except BagError as error:
            print_error(f"ERROR reading {error}")
            return 1
        for problem in problems:
            code = 1
            print_error(f"ERROR reading {problem}")
        if problems:
            warn(f"{bag}: what can be read follows; 'rosz bag reindex' makes a whole bag of it")
        if json:
            rows.append(summary)
            continue
        text = format_yaml(summary) if as_yaml else format_summary(summary)
        print_lines([_value(text, key) if key else text])
        if number < len(bags) - 1:
            print_lines(["---"])
    if json:
        print_json(rows)
    return code


def _value(text: str, key: str) -> str:
    """Return one value of YAML as text; names are joined by dots."""
    import yaml

    value: Any = yaml.safe_load(text)
    for name in key.split("."):
        if not isinstance(value, dict) or name not in value:
            keys = list(value) if isinstance(value, dict) else []
            raise UsageError(f"the bag's description has no key '{key}'{near_miss(name, keys)}")
        value = value[name]
    if not isinstance(value, list):
        return str(value)
    rows = ["\n  ".join(f"{name}: {member}" for name, member in row.items()) for row in value]
    return "".join(f"- {row}\n" for row in rows)
