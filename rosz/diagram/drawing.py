"""A picture as text: SVG, Graphviz' DOT, and Mermaid; pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from rosz.diagram.labels import place_labels
from rosz.diagram.layers import BoxPlace, PictureLayout, lay_out
from rosz.diagram.picture import Arrow, Box, Picture

_FEW = 2
_LETTER = 6.3
_LABEL_STEP = 8
_RATE_LETTERS = 7
"""Room for a rate that gets longer while the picture stays."""
_NARROWEST_GAP, _WIDEST_GAP = 72.0, 260.0
_GROUP_MARGIN = 8.0
_STYLE = Path(__file__).with_name("style.css").read_text("utf-8")


def label_of(arrow: Arrow, rates: Mapping[str, str]) -> str:
    """Return the label of an arrow.

    Between nodes: the topics with their rates, or the number of topics if these are more than two.
    From a node to a topic: the rate alone. From a topic to a node: none.
    """
    measured = [topic for topic in arrow.topics if topic in rates]
    if arrow.start.startswith("topic:"):
        return ""
    if arrow.end.startswith("topic:"):
        return rates[measured[0]] if measured else ""
    if len(arrow.topics) > _FEW:
        return f"{len(arrow.topics)} topics"
    return ", ".join(
        f"{topic} {rates[topic]}" if topic in rates else topic for topic in arrow.topics
    )


def labels_of(picture: Picture, rates: Mapping[str, str]) -> list[str]:
    """Return the labels of all arrows.

    Args:
        picture: The picture.
        rates: Rate of each topic as text.
    """
    return [label_of(arrow, rates) for arrow in picture.arrows]


def write_svg(picture: Picture, rates: Mapping[str, str] | None = None, chosen: str = "") -> str:
    """Return a picture as SVG.

    Each box has its key as ``data-key``, and each label of an arrow its number as ``data-arrow``.

    Args:
        picture: The picture.
        rates: Rate of each topic as text, for the arrows.
        chosen: Key of the box to emphasise.
    """
    labels = labels_of(picture, rates or {})
    plain = [label_of(arrow, {}) for arrow in picture.arrows]
    # Rounded up, so that a new rate seldom moves the boxes.
    wide = -(-max(map(len, labels), default=0) // _LABEL_STEP) * _LABEL_STEP
    longest = max(wide, max(map(len, plain), default=0) + _LABEL_STEP * bool(rates))
    gap = min(_WIDEST_GAP, max(_NARROWEST_GAP, longest * _LETTER + 24))
    layout = lay_out(picture, gap)
    room = _RATE_LETTERS if rates else 0
    places = place_labels(layout.paths, [len(text) and max(len(text), room) for text in labels])
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="nodes and topics"'
        f' viewBox="0 0 {layout.width:.0f} {layout.height:.0f}" width="{layout.width:.0f}"'
        f' height="{layout.height:.0f}"><style>\n{_STYLE}</style><defs><marker id="tip"'
        ' viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path class="tip" d="M0 0L8 4L0 8z"/></marker></defs>',
        *_groups(layout),
        *(
            _arrow(arrow, path, _text(number, label, place))
            for number, (arrow, path, label, place) in enumerate(
                zip(picture.arrows, layout.paths, labels, places, strict=True)
            )
        ),
        *(_box(place, chosen) for place in layout.places.values()),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def _box(place: BoxPlace, chosen: str) -> str:
    box = place.box
    name, key = escape(box.name), escape(box.key, quote=True)
    kind = f"{box.kind} chosen" if box.key == chosen else box.kind
    radius = place.height / 2 if box.kind == "node" else 3
    title = f"{name} [{escape(box.detail)}]" if box.detail else name
    return (
        f'<g class="{kind}" data-key="{key}" tabindex="0" role="button"><title>{title}</title>'
        f'<rect x="{place.x:.1f}" y="{place.y:.1f}" width="{place.width:.1f}"'
        f' height="{place.height:.1f}" rx="{radius:.0f}"/><text'
        f' x="{place.x + place.width / 2:.1f}" y="{place.y + place.height / 2 + 4:.1f}">{name}'
        "</text></g>"
    )


def _arrow(arrow: Arrow, path: Sequence[tuple[float, float]], text: str) -> str:
    title = escape(", ".join(arrow.topics))
    return (
        f'<g class="arrow"><title>{title}</title><path d="{_curve(path)}" marker-end="url(#tip)"/>'
        f"{text}</g>"
    )


def _text(number: int, label: str, place: tuple[float, float, bool]) -> str:
    """Return the label of an arrow; without room it is only shown while the pointer is there."""
    x, y, has_room = place
    kind = "" if has_room else ' class="crowded"'
    return f'<text data-arrow="{number}"{kind} x="{x:.0f}" y="{y - 3:.0f}">{escape(label)}</text>'


def _curve(path: Sequence[tuple[float, float]]) -> str:
    """Return an SVG path that is horizontal at each point, with whole coordinates.

    Most of the text of a large picture is such paths, so they are kept short.
    """
    x, y = map(round, path[0])
    drawn, pen_x = f"M{x} {y}", x
    for right, down in path[1:]:
        dx, dy = round(right) - x, round(down) - y
        if dy:
            if pen_x != x:
                drawn += f"H{x}"
            drawn += f"c{dx / 2:g} 0 {dx / 2:g} {dy} {dx} {dy}"
        x, y = x + dx, y + dy
        if dy:
            pen_x = x
    return drawn if pen_x == x else f"{drawn}H{x}"


def _groups(layout: PictureLayout) -> list[str]:
    """Return a frame around the boxes of each group, in each layer that has some."""
    frames: dict[tuple[str, float], list[BoxPlace]] = {}
    for place in layout.places.values():
        if place.box.group:
            column = round(place.x + place.width / 2)
            frames.setdefault((place.box.group, column), []).append(place)
    drawn = []
    for (group, _), places in frames.items():
        left = min(place.x for place in places) - _GROUP_MARGIN
        top = min(place.y for place in places) - _GROUP_MARGIN
        right = max(place.x + place.width for place in places) + _GROUP_MARGIN
        bottom = max(place.y + place.height for place in places) + _GROUP_MARGIN
        drawn.append(
            f'<rect class="group" x="{left:.1f}" y="{top:.1f}" width="{right - left:.1f}"'
            f' height="{bottom - top:.1f}" rx="6"/><text class="group-name" x="{left + 4:.1f}"'
            f' y="{top - 3:.1f}">{escape(group)}</text>'
        )
    return drawn


def write_dot(picture: Picture) -> str:
    """Return a picture in the language of Graphviz."""
    lines = ["digraph graphname {", "  rankdir=LR;"]
    groups: dict[str, list[Box]] = {}
    for box in picture.boxes:
        groups.setdefault(box.group, []).append(box)
    for number, (group, boxes) in enumerate(sorted(groups.items())):
        indent = "    " if group else "  "
        if group:
            lines += [f"  subgraph cluster_{number} {{", f"    label={_quoted(group)};"]
        for box in boxes:
            shape = "ellipse" if box.kind == "node" else "box"
            lines.append(f"{indent}{_quoted(box.key)} [label={_quoted(box.name)}, shape={shape}];")
        if group:
            lines.append("  }")
    for arrow in picture.arrows:
        label = label_of(arrow, {})
        more = f" [label={_quoted(label)}]" if label else ""
        lines.append(f"  {_quoted(arrow.start)} -> {_quoted(arrow.end)}{more};")
    return "\n".join([*lines, "}", ""])


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def write_mermaid(picture: Picture) -> str:
    """Return a picture as a flowchart of Mermaid."""
    ids = {box.key: f"n{number}" for number, box in enumerate(picture.boxes)}
    lines = ["flowchart LR"]
    for box in picture.boxes:
        left, right = ("([", "])") if box.kind == "node" else ("[", "]")
        lines.append(f'  {ids[box.key]}{left}"{_entity(box.name)}"{right}')
    for arrow in picture.arrows:
        label = label_of(arrow, {})
        join = f'-- "{_entity(label)}" -->' if label else "-->"
        lines.append(f"  {ids[arrow.start]} {join} {ids[arrow.end]}")
    return "\n".join([*lines, ""])


def _entity(text: str) -> str:
    return text.replace("#", "#35;").replace('"', "#quot;")
