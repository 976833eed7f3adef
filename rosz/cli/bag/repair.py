"""``rosz bag check``, ``fix``, ``reindex``, ``compress`` and ``decompress``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rosz.cli.bag.source import app, compression_of
from rosz.cli.call import Call
from rosz.cli.console import count, print_error, print_json, print_lines, warn
from rosz.cli.declare import Argument, Json, Option
from rosz.errors import BagError, BagUnindexed, RoszError, UsageError

if TYPE_CHECKING:
    from rosz.bags import Compression
    from rosz.bags.edit import Copied, TypeDifference

_Bags = Annotated[list[str], Argument("BAG")]
_OutputDir = Annotated[str, Option("--output-dir DIR", "Write to this folder.")]
_Force = Annotated[bool, Option("-f --force", "Replace older backups.")]
_Quiet = Annotated[bool, Option("-q --quiet", "Print problems only.")]


@app.command("check")
def check_command(call: Call, bags: _Bags, *, json: Json = False) -> int:
    """Read bags whole, and compare their types with those that are known here."""
    from rosz.bags import open_reader
    from rosz.bags.edit import check_bag, find_differences

    rows = []
    for bag in bags:
        differences: list[TypeDifference] = []
        try:
            with open_reader(bag) as reader:
                read, problems = check_bag(reader)
                differences = find_differences(reader.channels, call.types)
        except BagError as error:
            read, problems = 0, [error]
        rows.append(
            {
                "bag": bag,
                "messages": read,
                "problems": [str(problem) for problem in problems],
                "types": {difference.type: difference.reason for difference in differences},
            }
        )
        if json:
            continue
        for problem in problems:
            print_error(f"ERROR: {problem}")
        for difference in differences:
            print_lines([f"{bag}: {difference.type}: {difference.reason}"])
        if not problems and not differences:
            print_lines(["Bag file does not need any migrations."])
    if json:
        print_json(rows)
    return int(any(row["problems"] or row["types"] for row in rows))


@app.command("fix")
def fix_command(
    bag: Annotated[str, Argument("BAG")], output: Annotated[str, Argument("OUTPUT")]
) -> int:
    """Write what can be read of a damaged bag into a new one."""
    from rosz.bags.edit import recover

    return _report([recover(Path(bag), output)], quiet=False)


@app.command("reindex")
def reindex_command(
    bags: _Bags, *, output_dir: _OutputDir = "", force: _Force = False, quiet: _Quiet = False
) -> int:
    """Give bags an index, as those need it whose recorder was killed.

    The old bag is kept as NAME.orig.mcap; NAME.mcap.active becomes NAME.mcap.
    """
    return _rewrite(bags, None, output_dir, force=force, quiet=quiet)


@app.command("compress")
def compress_command(
    bags: _Bags,
    *,
    bz2: Annotated[bool, Option("-j --bz2", "Use bz2, which only ROS 1's bags have.")] = False,
    lz4: Annotated[bool, Option("--lz4", "Use lz4.")] = False,
    zstd: Annotated[bool, Option("--zstd", "Use zstd, which only MCAP has.")] = False,
    output_dir: _OutputDir = "",
    force: _Force = False,
    quiet: _Quiet = False,
) -> int:
    """Compress bags: with zstd in MCAP, with bz2 in ROS 1's format."""
    chosen = compression_of(bz2=bz2, lz4=lz4, zstd=zstd)
    by_suffix: dict[str, Compression] = {".bag": "bz2"}
    return max(
        _rewrite(
            [bag],
            chosen or by_suffix.get(Path(bag).suffix, "zstd"),
            output_dir,
            force=force,
            quiet=quiet,
        )
        for bag in bags
    )


@app.command("decompress")
def decompress_command(
    bags: _Bags, *, output_dir: _OutputDir = "", force: _Force = False, quiet: _Quiet = False
) -> int:
    """Write bags without compression."""
    return _rewrite(bags, "none", output_dir, force=force, quiet=quiet)


def _rewrite(
    bags: Sequence[str],
    compression: Compression | None,
    output_dir: str,
    *,
    force: bool,
    quiet: bool,
) -> int:
    from rosz.bags.edit import rewrite

    code = 0
    folder = Path(output_dir) if output_dir else None
    for bag in bags:
        try:
            copied = rewrite(Path(bag), compression, folder=folder, force=force)
        except RoszError as error:
            if isinstance(error, UsageError):
                raise
            print_error(f"ERROR: {error}")
            code = 1
        else:
            code = max(code, _report([copied], quiet=quiet))
    return code


def _report(done: Sequence[Copied], *, quiet: bool) -> int:
    """Print results; return the exit code, which is 1 if something was damaged."""
    code = 0
    for copied in done:
        for problem in copied.problems:
            warn(str(problem))
            code = max(code, int(not isinstance(problem, BagUnindexed)))
        if not quiet:
            backup = f"; the old bag is {copied.backup}" if copied.backup else ""
            print_lines([f"{copied.path}: {count(copied.count, 'message')}{backup}"])
    return code
