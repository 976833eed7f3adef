"""map_server and map_saver."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import pytest
from network import TIMEOUT, Network
from PIL import Image as Pillow

from rosz.msgs.nav_msgs.msg import MapMetaData, OccupancyGrid
from rosz.msgs.nav_msgs.srv import GetMap, LoadMap
from rosz.programs.map_server import Image, MapError, load_map, occupancy, read_image, write_map

META = """image: {image}
resolution: 0.1
origin: [2.0, 3.0, 1.0]
negate: {negate}
occupied_thresh: 0.65
free_thresh: 0.196
mode: {mode}
"""
SHADES = bytes([0, 80, 100, 205, 206, 254])
"""Two rows of three pixels; 205 has the darkness 0.19608, just above the threshold of free."""


def make(folder: Path, *, negate: int = 0, mode: str = "trinary", image: str = "") -> Path:
    (folder / "a.pgm").write_bytes(b"P5\n# of a test\n3 2\n255\n" + SHADES)
    file = folder / "a.yaml"
    file.write_text(META.format(image=image or "a.pgm", negate=negate, mode=mode))
    return file


def test_a_map_begins_at_the_bottom(tmp_path: Path) -> None:
    grid = load_map(make(tmp_path))
    assert list(grid.data) == [-1, 0, 0, 100, 100, -1]
    info = grid.info
    assert (info.width, info.height) == (3, 2)
    assert math.isclose(info.resolution, 0.1, rel_tol=1e-6)
    assert (info.origin.position.x, info.origin.position.y) == (2.0, 3.0)
    assert math.isclose(info.origin.orientation.z, math.sin(0.5))


def test_the_other_modes(tmp_path: Path) -> None:
    assert list(load_map(make(tmp_path, mode="raw")).data) == [-51, -50, -2, 0, 80, 100]
    # 98 * (0.6078 - 0.196) / 0.454 = 88.9
    assert list(load_map(make(tmp_path, mode="scale")).data) == [1, 0, 0, 100, 100, 89]
    assert list(load_map(make(tmp_path, negate=1)).data) == [100, 100, 100, 0, -1, -1]


def test_an_image_of_several_channels() -> None:
    image = Image(2, 1, 4, alpha=True, data=bytes([100, 100, 100, 0, 0, 0, 0, 255]))
    cells = occupancy(image, negate=False, occupied=0.65, free=0.196, mode="scale")
    assert list(cells) == [-1, 100]  # what is transparent is unknown


@pytest.mark.parametrize("mode", ["L", "RGB", "P", "RGBA"])
def test_images_that_pillow_reads(tmp_path: Path, mode: str) -> None:
    file = tmp_path / "a.png"
    Pillow.frombytes("L", (3, 2), SHADES).convert(mode).save(file)
    image = read_image(file)
    assert (image.width, image.height) == (3, 2)
    assert image.data[:: image.channels] == SHADES


def test_pgm_as_text_and_of_two_bytes(tmp_path: Path) -> None:
    file = tmp_path / "a.pgm"
    file.write_text("P2 # text\n2 1\n15\n0 15\n")
    assert read_image(file).data == b"\x00\xff"
    file.write_bytes(b"P5 2 1 65535\n\x00\x00\xff\xff")
    assert read_image(file).data == b"\x00\xff"


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (("resolution: 0.1", "resolution: fine"), "resolution is 'fine'; expected a number"),
        (("negate: 0\n", ""), "has no 'negate'"),
        (("a.pgm", "b.pgm"), "b.pgm' cannot be read: No such file"),
        (("trinary", "odd"), "mode is 'odd'; expected one of trinary, scale, raw"),
        (("[2.0, 3.0, 1.0]", "7"), "origin is 7; expected"),
        (("image: a.pgm", "- x"), "is not YAML"),
    ],
)
def test_a_map_that_cannot_be_used(tmp_path: Path, change: tuple[str, str], text: str) -> None:
    file = make(tmp_path)
    file.write_text(file.read_text().replace(*change))
    with pytest.raises(MapError, match=text):
        load_map(file)
    (tmp_path / "a.pgm").write_bytes(b"P5 3 2 255\n123")
    with pytest.raises(MapError, match="has 3 of 6 pixels"):
        read_image(tmp_path / "a.pgm")


def test_without_pillow_other_images_say_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.png").write_bytes(b"\x89PNG")
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(MapError, match=r"pip install 'rosz\[maps\]'"):
        read_image(tmp_path / "a.png")


def test_a_map_is_written_as_it_was_read(tmp_path: Path) -> None:
    grid = load_map(make(tmp_path))
    write_map(grid, str(tmp_path / "b"), occupied=65, free=25)
    again = load_map(tmp_path / "b.yaml")
    assert (again.data, again.info) == (grid.data, grid.info)
    with pytest.raises(MapError, match="cannot be written"):
        write_map(grid, str(tmp_path / "no" / "b"), occupied=65, free=25)


def test_the_programs(network: Network, tmp_path: Path) -> None:
    file = make(tmp_path)
    server = network.run("-m", "rosz", "run", "map_server", "map_server", str(file))
    server.wait_for("Read a 3 X 2 map @ 0.100 m/cell")
    user = network.node("user")
    grid = user.subscription("map", OccupancyGrid).get(TIMEOUT)
    assert grid.header.frame_id == "map"
    assert user.subscription("map_metadata", MapMetaData).get(TIMEOUT) == grid.info
    served = user.client("static_map", GetMap)
    served.wait_for_service(TIMEOUT)
    assert served().map.data == grid.data
    change = user.client("change_map", LoadMap)
    assert change("/no/such.yaml").result == LoadMap.Response.RESULT_UNDEFINED_FAILURE
    server.wait_for("map '/no/such.yaml' cannot be read")
    assert change(str(make(tmp_path, negate=1))).result == LoadMap.Response.RESULT_SUCCESS
    name = str(tmp_path / "saved")
    saver = network.run("-m", "rosz", "run", "map_server", "map_saver", "-f", name)
    assert saver.exit_code() == 0, saver.output
    assert list(load_map(Path(f"{name}.yaml")).data) == [100, 100, 100, 0, -1, -1]
