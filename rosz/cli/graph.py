"""``rosz graph``: who sends what to whom, as text or as a picture."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from rosz.cli import suggest
from rosz.cli.call import Call
from rosz.cli.console import print_result, write_file
from rosz.cli.declare import App, Json, Option, at_least
from rosz.errors import UsageError

__all__ = ("app",)

app = App()

_SUFFIXES = (".svg", ".dot", ".mmd")


@app.command()
def graph_command(
    *,
    output: Annotated[
        str, Option("-o --output FILE", "Write a picture: .svg, .dot or .mmd.", suggest.files)
    ] = "",
    content: Annotated[
        str,
        Option(
            "--content WHAT",
            "nodes, active (with topics that connect nodes) or all (with all topics).",
            lambda _: ["nodes", "active", "all"],
        ),
    ] = "nodes",
    nodes: Annotated[
        str, Option("--nodes PATTERNS", "Nodes to show; those after '-' are left out.")
    ] = "",
    topics: Annotated[
        str, Option("--topics PATTERNS", "Topics to show; those after '-' are left out.")
    ] = "",
    group: Annotated[int, Option("--group DEPTH", "Draw frames around namespaces.")] = 0,
    debug: Annotated[bool, Option("--debug", "Show /rosout, /clock and tools too.")] = False,
    no_tf: Annotated[bool, Option("--no-tf", "Leave out /tf and /tf_static.")] = False,
    json: Json = False,
) -> None:
    """Print who sends what to whom, or write it as a picture."""
    at_least("--group", group, 0, "names")
    suffix = Path(output).suffix.lower()
    if output and suffix not in _SUFFIXES:
        raise UsageError(f"'{output}' does not end in {', '.join(_SUFFIXES)}")
    from rosz.diagram import PictureOptions, make_picture, write_dot, write_mermaid, write_svg

    options = PictureOptions(
        content=content,  # type: ignore[arg-type]  # checked below
        nodes=nodes,
        topics=topics,
        group=group,
        hide_debug=not debug,
        hide_tf=no_tf,
    )
    call = Call()
    picture = make_picture(call.survey().view.tokens, options)
    if output:
        write = {".svg": write_svg, ".dot": write_dot, ".mmd": write_mermaid}[suffix]
        write_file(output, write(picture).encode())
        return
    ends = {end for arrow in picture.arrows for end in (arrow.start, arrow.end)}
    lines = [f"{_name(a.start)} -> {_name(a.end)}{_topics(a.topics)}" for a in picture.arrows]
    lines += [box.name for box in picture.boxes if box.key not in ends]
    print_result(lines, picture, as_json=json)
    sys.stdout.flush()


def _name(key: str) -> str:
    return key.partition(":")[2]


def _topics(topics: tuple[str, ...]) -> str:
    return f"   {', '.join(topics)}"
