"""``rosz graph`` and ``rosz turtlesim``: pictures of how nodes connect, and of turtlesims."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from rosz.cli import suggest
from rosz.cli.call import Call, new_group
from rosz.cli.console import print_result, write_file
from rosz.cli.declare import App, Argument, Json, Option, at_least
from rosz.errors import UsageError

graph = App()
turtlesim = new_group(
    "Save pictures of turtlesims; 'rosz run turtlesim turtlesim_node' starts one."
)

_SUFFIXES = (".svg", ".dot", ".mmd")


@graph.command()
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
    lines = [
        f"{_name(arrow.start)} -> {_name(arrow.end)}   {', '.join(arrow.topics)}"
        for arrow in picture.arrows
    ]
    lines += [box.name for box in picture.boxes if box.key not in ends]
    print_result(lines, picture, as_json=json)


def _name(key: str) -> str:
    return key.partition(":")[2]


@turtlesim.command("snapshot")
def snapshot_command(
    call: Call,
    file: Annotated[str, Argument("FILE.png", "The file; '-' is standard output.", suggest.files)],
    *,
    node: Annotated[str, Option("--node NODE", "Turtlesim, if several run.", suggest.nodes)] = "",
) -> None:
    """Save a picture of the field with its turtles."""
    from rosz.turtlesim import fetch

    if file != "-" and Path(file).suffix.lower() != ".png":
        raise UsageError(f"'{file}' does not end in .png; the picture is written as PNG")
    with call.session() as session:
        picture = fetch(session, call.domain, call.resolve(node) if node else "")
    if file == "-":
        sys.stdout.buffer.write(picture.png)
    else:
        write_file(file, picture.png)
