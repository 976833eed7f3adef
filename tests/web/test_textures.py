"""Textures of robots and meshes, without a browser."""

from __future__ import annotations

import contextlib
import io
import json
import struct
from pathlib import Path
from typing import Any

import pytest

from rosz.environment import Environment
from rosz.errors import UsageError
from rosz.transforms import IDENTITY
from rosz.web.scene import Meshes
from rosz.web.scene.drawing import Drawing
from rosz.web.scene.robot import draw_visual, read_visuals

from .test_scene import parts

Image = pytest.importorskip("PIL.Image")

CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
FACE = "f 1/1 2/2 3/3\n"
MATERIAL = '<material name="m"><texture filename="package://robot/{}"/></material>'


@pytest.fixture
def sources() -> list[Any]:
    return []


@pytest.fixture
def meshes(tmp_path: Path, sources: list[Any]) -> Meshes:
    folder = tmp_path / "src" / "robot"
    (folder / "v1.0").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>robot</name></package>")
    picture = Image.new("RGB", (2, 2), (10, 20, 30))
    for name in ("skin.png", "skin.tga", "skin.jpg"):
        picture.save(folder / name)
    (folder / "text.png").write_text("no picture")
    (folder / "v1.0" / "skin.mtl").write_text("newmtl m\nmap_Kd ..\\skin.tga\n")
    (folder / "v1.0" / "gone.mtl").write_text("newmtl m\nmap_Kd gone.png\n")
    for name in ("skin", "gone"):
        text = f"mtllib {name}.mtl\n{CORNERS}usemtl m\n{FACE}"
        (folder / "v1.0" / f"{name}.obj").write_text(text)
    (folder / "plain.obj").write_text(CORNERS + FACE)
    triangle = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    (folder / "part.stl").write_bytes(bytes(80) + struct.pack("<I", 1) + triangle)
    (folder / "skin.glb").write_bytes(glb("skin.jpg"))

    def add(source: Any) -> str:
        sources.append(source)
        return str(len(sources) - 1)

    return Meshes(Environment.read({"ROSZ_PACKAGE_PATH": str(tmp_path / "src")}), add)


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack("<I4s", len(data), kind) + data


def whole(*chunks: bytes, version: int = 2) -> bytes:
    body = b"".join(chunks)
    return struct.pack("<4sII", b"glTF", version, 12 + len(body)) + body


_AWAY = b'{"asset":{"version":"2.0"},"buffers":[{"byteLength":9,"uri":"http://evil.example/b"}]}'
_HERE = b'{"asset":{"version":"2.0"}}'
_DEEP = b'{"asset":{"version":"2.0"},"extensions":{"X":[{"uri":"//evil.example/b"}]}}'


@pytest.mark.parametrize(
    "data",
    [
        _AWAY,
        whole(chunk(b"JSON", _AWAY)),
        whole(chunk(b"JSON", _HERE), chunk(b"JSON", _AWAY)),
        whole(chunk(b"BIN\0", b"x"), chunk(b"JSON", _AWAY)),
        whole(chunk(b"JSON", _DEEP)),
        whole(chunk(b"JSON", _HERE)) + chunk(b"JSON", _AWAY),
        whole(chunk(b"JSON", _AWAY), version=1),
        whole(chunk(b"JSON", b"[" * 100_000)),
    ],
    ids=["text", "plain", "second", "late", "extension", "behind", "old", "deep"],
)
def test_no_mesh_leads_a_browser_elsewhere(
    meshes: Meshes, tmp_path: Path, sources: list[Any], data: bytes
) -> None:
    (tmp_path / "src" / "robot" / "away.glb").write_bytes(data)
    with contextlib.suppress(UsageError):  # it is not a mesh that can be read
        meshes.find("package://robot/away.glb")
    assert not any(b"evil" in source()[0] for source in sources)


def test_a_mesh_of_one_file_is_sent_as_it_is(
    meshes: Meshes, tmp_path: Path, sources: list[Any]
) -> None:
    data = whole(chunk(b"JSON", _HERE), chunk(b"BIN\0", bytes(8)))
    (tmp_path / "src" / "robot" / "own.glb").write_bytes(data)
    meshes.find("package://robot/own.glb")
    assert sources[-1]()[0] == data


@pytest.mark.parametrize("uri", ["package://[/a.stl", "http://[", "file://[/x.stl"])
def test_malformed_addresses_of_meshes(meshes: Meshes, uri: str) -> None:
    with pytest.raises(UsageError):
        meshes.find(uri)


def glb(image: str) -> bytes:
    """Return a triangle whose texture is in another file."""
    data = struct.pack("<9f6f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1)
    attributes = {"POSITION": 0, "TEXCOORD_0": 1}
    tree = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"uri": image}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 24},
        ],
        "buffers": [{"byteLength": 60}],
    }
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data))
    chunk = struct.pack("<I4s", len(text), b"JSON") + text
    return head + chunk + struct.pack("<I4s", len(data), b"BIN\0") + data


def inner_tree(data: bytes) -> dict[str, Any]:
    """Return the JSON of a GLB."""
    (length,) = struct.unpack_from("<I", data, 12)
    found: dict[str, Any] = json.loads(data[20 : 20 + length])
    return found


def draw(meshes: Meshes, geometry: str, material: str) -> tuple[dict[str, Any], list[str]]:
    """Return what is drawn of a link, and what is not shown."""
    text = f"<visual><geometry>{geometry}</geometry>{material}</visual>"
    (visual,) = read_visuals(f'<robot><link name="base">{text}</link></robot>')
    drawing = Drawing()
    faults = draw_visual(visual, IDENTITY, meshes, drawing)
    (part,) = parts(drawing)
    return part, faults


@pytest.mark.parametrize("path", ["v1.0/skin.obj", "skin.glb"])
def test_textures_of_meshes_come_along(meshes: Meshes, sources: list[Any], path: str) -> None:
    pytest.importorskip("collada")
    mesh = meshes.find(f"package://robot/{path}")
    assert (mesh.form, mesh.colored, mesh.mapped, mesh.missing) == ("glb", True, True, ())
    data, media = sources[0]()
    assert media == "model/gltf-binary"
    (image,) = inner_tree(data)["images"]
    assert "bufferView" in image


def test_a_mesh_without_its_texture_is_drawn_and_says_so(meshes: Meshes) -> None:
    pytest.importorskip("collada")
    part, faults = draw(meshes, '<mesh filename="package://robot/v1.0/gone.obj"/>', "")
    assert (part["kind"], part["color"]) == ("model", None)
    assert len(faults) == 1
    assert faults[0].startswith("without 'gone.png': package 'robot'")


def test_materials_have_textures(meshes: Meshes, sources: list[Any]) -> None:
    pytest.importorskip("collada")
    box = '<box size="1 1 1"/>'
    part, faults = draw(meshes, box, MATERIAL.format("skin.png"))
    assert (part["texture"], part["colors"].tolist(), faults) == ("0", [[255] * 4], [])
    assert sources[0]()[1] == "image/png"
    part, faults = draw(meshes, box, MATERIAL.format("skin.tga"))
    assert sources[1]()[1] == "image/png"
    assert sources[1]()[0].startswith(b"\x89PNG")
    # A mesh without texture coordinates has one color of the texture, as in rviz.
    part, faults = draw(
        meshes, '<mesh filename="package://robot/part.stl"/>', MATERIAL.format("skin.png")
    )
    assert (part["texture"], part["color"], faults) == ("", [10, 20, 30, 255], [])
    plain = '<mesh filename="package://robot/plain.obj"/>'
    part, faults = draw(meshes, plain, MATERIAL.format("skin.png"))
    assert (part["texture"], part["color"], faults) == ("0", [255] * 4, [])
    red = '<material name="r"><color rgba="1 0 0 1"/></material>'
    assert draw(meshes, plain, red)[0]["color"] == [255, 0, 0, 255]
    own = '<mesh filename="package://robot/v1.0/skin.obj"/>'
    assert draw(meshes, own, red)[0]["color"] is None


def test_a_texture_that_cannot_be_shown_is_named(meshes: Meshes) -> None:
    for name, why in (
        ("none.png", "has no file 'none.png'"),
        ("text.png", "'package://robot/text.png' is not a picture that can be read"),
        ("skin.dds", "skin.dds' cannot be shown; expected one of .bmp"),
        ("../../skin.png", "without its texture: "),
    ):
        part, faults = draw(meshes, '<sphere radius="1"/>', MATERIAL.format(name))
        assert part["texture"] == ""
        assert len(faults) == 1
        assert why in faults[0]
    with pytest.raises(UsageError, match="is in no package"):
        meshes.texture("file:///etc/skin.png")


def test_bytes_that_only_seem_to_be_a_picture_are_refused() -> None:
    from rosz.web.scene.meshes import read_texture

    buffer = io.BytesIO()
    Image.new("RGB", (64, 64)).save(buffer, "PNG")
    with pytest.raises(UsageError, match="not a picture that can be read"):
        read_texture("package://a/b.png", buffer.getvalue()[:-30])
