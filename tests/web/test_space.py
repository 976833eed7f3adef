"""The view in space in a real browser: what is drawn is there, and what one points at arrives."""

from __future__ import annotations

import base64
import json
import math
import struct
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest
from hosts.scripts import slack
from network import TIMEOUT, Network

from rosz.msgs.geometry_msgs.msg import Pose, Quaternion, Vector3
from rosz.msgs.std_msgs.msg import ColorRGBA, Header
from rosz.msgs.visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerControl,
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerUpdate,
    Marker,
)

from .robot import (
    LONG,
    SPACE,
    THEMES,
    World,
    eventually,
    open_browser,
    set_screen,
    start_server,
    take_picture,
)

pytestmark = [pytest.mark.system]

_SHOW = "show=grid,tf,robot,/map,/cloud,/scan;color=%23ff3030,/markers,/path;color=%231f9d61"
_RED = ColorRGBA(0.8, 0.2, 0.2, 1.0)
_PICTURE = (
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGNIMPgAAAJ0AYFMZMHJAAAAAElFTkSuQmCC"
)
"""A PNG of one pixel."""
_PAINTED = """<robot name="p"><link name="map"><visual><geometry><box size="2 2 2"/></geometry>
<material name="m"><texture filename="package://painted/skin.png"/></material></visual></link>
</robot>"""
_DRAW_SELDOM = """
{
  const draw = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (step) => setTimeout(() => draw(step), 100);
  window.cancelAnimationFrame = clearTimeout;
}
"""
"""Without a graphics processor, to draw thirty times a second is most of what a machine can do."""
_STEP = 0.2
"""Seconds between the steps of a hand that drags, in which the page is drawn."""
_DRAWN = """
const root = Object.entries(window).find(([name]) => name.startsWith('scene_c'))?.[1];
const found = {};
root?.traverse((one) => {
  const kind = one.isPoints ? 'points' : one.isInstancedMesh ? 'shapes'
    : one.material?.map ? 'image' : one.isLineSegments ? 'lines' : '';
  const count = one.isInstancedMesh ? one.count : one.geometry?.attributes.position.count ?? 0;
  if (kind) found[kind] = Math.max(found[kind] ?? 0, count);
});
return found;
"""


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    network = Network()
    try:
        with open_browser() as browser:
            seldom = {"source": _DRAW_SELDOM}
            browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", seldom)
            robot = network.program(SPACE)
            robot.wait_for("ready", LONG)
            package = network.folder / "painted"
            package.mkdir()
            (package / "package.xml").write_text("<package><name>painted</name></package>")
            (package / "skin.png").write_bytes(base64.b64decode(_PICTURE))
            paths = {"ROSZ_PACKAGE_PATH": str(network.folder)}
            server = start_server(network, **paths)
            yield World(network, robot, server, browser)
    finally:
        network.close()


def drawn(world: World) -> dict[str, int]:
    """Return the largest number of elements of each kind that the browser draws."""
    found: dict[str, int] = world.ask(_DRAWN)
    return found


def test_a_robot_and_its_world_are_shown(
    world: World, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.getbasetemp() / "artefacts"
    for screen, theme in THEMES:
        set_screen(world.browser, screen, theme)
        world.open(f"/3d?{_SHOW}")
        world.should_see("a marker", "base_link", "102400 points", "100 x 80 cells", "360 of 360")
        world.should_see("4 markers", "2 links", "nowhere")

        def complete() -> bool:
            found = drawn(world)
            return found.get("points") == 102400 and {"shapes", "lines", "image"} <= found.keys()

        eventually(complete, "all kinds of things in the view", LONG)
        take_picture(world.browser, folder, f"space-{screen}-{theme}")
        wide = "return document.documentElement.scrollWidth - window.innerWidth"
        assert world.ask(wide) <= 0
        assert world.messages() == []


def pull(world: World, tool: str) -> None:
    """Take a tool, and pull with it in the middle of the view."""
    from selenium.webdriver import ActionChains

    taken = "return document.querySelector('.rosz-scene canvas').dataset.tool"
    if not world.ask(taken):
        world.click_until(tool, lambda: bool(world.ask(taken)))
    canvas = world.browser.find_element("css selector", ".rosz-scene canvas")
    keys: Any = ActionChains(world.browser, duration=20)
    keys.move_to_element_with_offset(canvas, 60, 40).click_and_hold()
    keys.move_by_offset(60, 0).release().perform()


def test_what_one_points_at_arrives(world: World) -> None:
    set_screen(world.browser, "laptop", "light")
    world.open(f"/3d?{_SHOW}&view=top")
    world.should_see("102400 points")
    eventually(lambda: drawn(world).get("points"), "something in the view", LONG)

    def sent(tool: str, text: str) -> None:
        def arrived() -> bool:
            return text in world.robot.output

        def attempt() -> bool:
            pull(world, tool)
            return world.robot.wait_until(arrived, TIMEOUT / 4)

        eventually(attempt, f"what {tool} sends")
        idle = "return document.querySelector('.rosz-scene canvas').dataset.tool === ''"
        eventually(lambda: world.ask(idle), f"{tool} is put down", LONG)

    sent("Goal", "goes to ")
    assert " map" in world.robot.output.partition("goes to ")[2].partition("\n")[0]
    sent("Pose estimate", "starts at 0.25")
    sent("Point", "point ")
    assert world.messages() == []


def test_the_view_turns_and_displays_come_and_go(world: World) -> None:
    from selenium.webdriver import ActionChains

    set_screen(world.browser, "laptop", "light")
    world.open("/3d?show=grid,/scan;color=%23ff3030")
    world.should_see("360 of 360")
    where = """
const scene = getElement(Number(document.querySelector('.rosz-scene').id.slice(1)));
return scene.get_camera().position;
"""
    before = world.ask(where)

    def turned() -> bool:
        canvas = world.browser.find_element("css selector", ".rosz-scene canvas")
        ActionChains(world.browser).drag_and_drop_by_offset(canvas, 120, 30).perform()
        return bool(world.ask(where) != before)

    eventually(turned, "another view")
    world.press("Remove /scan", lambda: "points" not in drawn(world))
    eventually(lambda: "/scan" not in world.browser.current_url, "the address", LONG)
    assert "show=grid" in world.browser.current_url
    assert world.messages() == []


def test_an_empty_view_has_the_color_of_the_page(world: World) -> None:
    set_screen(world.browser, "laptop", "dark")
    world.open("/3d?show=/nothing")
    world.should_see("'/nothing' does not exist yet")
    colors = """
const { scene, renderer } = getElement(Number(document.querySelector('.rosz-scene').id.slice(1)));
const color = scene.background.clone();
const first = renderer.getClearColor(color.clone()).getHexString();
return [first, color.getHexString()];
"""
    eventually(lambda: world.ask(colors) == ["1b202a", "1b202a"], "a dark view")
    world.ask("document.body.classList.remove('body--dark')")
    eventually(lambda: world.ask(colors) == ["1b202a", "e9edf4"], "a light view")
    assert world.messages() == []


def test_a_view_that_does_not_change_is_not_drawn(world: World) -> None:
    world.open("/3d?frame=map&show=grid")
    eventually(lambda: drawn(world).get("lines", 0) > 0, "the grid")
    counts = """
const { renderer, scene, camera } =
  getElement(Number(document.querySelector('.rosz-scene').id.slice(1)));
let time = performance.now() + 1e6;
performance.now = () => time;
const draw = (change) => {
  change();
  const before = renderer.info.render.frame;
  renderer.render(scene, camera);
  return renderer.info.render.frame - before;
};
const found = [
  () => window.dispatchEvent(new Event('rosz-drawn')),
  () => { time += 500; },
  () => { camera.position.x += 1; },
  () => { time += 900; },
  () => { time += 200; },
].map(draw);
delete performance.now;
return found;
"""
    assert world.ask(counts) == [1, 0, 1, 0, 1]
    assert world.messages() == []


def test_a_texture_is_on_a_robot(world: World) -> None:
    world.network.node("painter").params.set("/painted", _PAINTED)
    world.open("/3d?frame=map&show=robot:/painted")
    world.should_see("1 links")
    size = """
const root = Object.entries(window).find(([name]) => name.startsWith('scene_c'))[1];
const found = [];
root.traverse((one) => {
  if (one.isInstancedMesh) found.push(one.material.map?.image?.width ?? 0);
});
return found;
"""
    eventually(lambda: world.ask(size) == [1], "the texture of the box")
    assert world.messages() == []


def test_meshes_reach_nothing_outside_packages(world: World) -> None:
    """Whatever a mesh refers to: the browser asks the page's server alone, and neither of them
    the server that stands for all others."""
    asked: list[str] = []

    class Elsewhere(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.path)
            self.send_error(404)

    elsewhere = ThreadingHTTPServer(("127.0.0.1", 0), Elsewhere)
    world.network.thread(elsewhere.serve_forever)
    away = f"http://127.0.0.1:{elsewhere.server_port}"
    secret = world.network.folder / "secret.stl"
    secret.write_bytes(bytes(80) + struct.pack("<I12fH", 1, *range(12), 0))
    package = world.network.folder / "painted"
    tree: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "scene": 0,
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"uri": f"{away}/image.png"}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": f"{away}/buffer.bin"}],
    }
    text = json.dumps(tree).encode()
    harmless = b'{"asset":{"version":"2.0"}}'
    parts = [struct.pack("<I4s", len(part), b"JSON") + part for part in (harmless, text)]
    size = 12 + sum(map(len, parts))
    (package / "text.glb").write_bytes(text)
    (package / "two.glb").write_bytes(struct.pack("<4sII", b"glTF", 2, size) + b"".join(parts))
    (package / "away.gltf").write_bytes(text)
    (package / "away.obj").write_text(
        f"mtllib {away}/m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n"
    )
    (package / "away.dae").write_text(
        f'<!DOCTYPE a [<!ENTITY e SYSTEM "{away}/entity">]><COLLADA version="1.4.1">'
        f'<library_images><image id="i"><init_from>{away}/dae.png</init_from></image>'
        "</library_images>&e;</COLLADA>"
    )
    meshes = [f"package://painted/{name}" for name in ("text.glb", "two.glb", "away.gltf")]
    meshes += ["package://painted/away.obj", "package://painted/away.dae", f"{away}/a.stl"]
    meshes += [f"{away}/a.glb", f"//{away[7:]}/a.stl", f"file://{secret}", "../secret.stl"]
    meshes += ["package://painted/../secret.stl", "package://painted/%2e%2e/secret.stl"]
    links = "".join(
        f'<visual><geometry><mesh filename="{mesh}"/></geometry>'
        f'<material name="m{n}"><texture filename="{away}/{n}.png"/></material></visual>'
        for n, mesh in enumerate(meshes)
    )
    links += (
        '<visual><geometry><box size="1 1 1"/></geometry><material name="t"><texture'
        f' filename="{away}/texture.png"/></material></visual>'
    )
    robot = f'<robot name="p"><link name="map">{links}</link></robot>'
    world.network.node("painter").params.set("/away", robot)
    world.open("/3d?frame=map&show=robot:/away,grid")
    world.should_see("1 links", "is in no package", "secret.stl")
    fetched = """
return performance.getEntriesByType('resource').map((one) => one.name)
  .filter((name) => !name.startsWith(location.origin) && !name.startsWith('blob:')
    && !name.startsWith('data:'));
"""
    eventually(lambda: drawn(world).get("lines", 0) > 0, "the grid")
    assert world.ask(fetched) == []
    assert asked == []
    elsewhere.shutdown()
    elsewhere.server_close()


def test_a_page_shows_a_limited_number_of_displays(world: World) -> None:
    began = time.monotonic()
    world.open("/3d?show=" + ",".join(f"/topic_{number}" for number in range(500)))
    world.should_see("'/topic_99' does not exist yet", "a page shows 100 displays")
    assert "/topic_100" not in world.text
    assert time.monotonic() - began < TIMEOUT * slack()


def test_a_handle_is_turned_and_pressed(world: World) -> None:
    from selenium.webdriver import ActionChains

    server = world.network.node("handles")
    got: list[Any] = []
    server.subscription("h/feedback", InteractiveMarkerFeedback, got.append)
    server.publisher("h/update", InteractiveMarkerUpdate)
    flat, up = Quaternion(0, 0, 0, 1), Quaternion(0, math.sqrt(0.5), 0, math.sqrt(0.5))
    turn = InteractiveMarkerControl("turn", up, interaction_mode=5)
    press = InteractiveMarkerControl("press", flat, interaction_mode=2)
    press.markers = [Marker(type=Marker.CUBE, scale=Vector3(1.6, 1.6, 0.1), color=_RED)]
    wheel = InteractiveMarker(header=Header(frame_id="map"), pose=Pose(orientation=flat))
    wheel.name, wheel.scale, wheel.controls = "wheel", 4.0, [turn, press]
    full = server.publisher("h/update_full", InteractiveMarkerInit, latch=True)
    full.publish(InteractiveMarkerInit("s", 1, [wheel]))
    set_screen(world.browser, "laptop", "light")
    world.open("/3d?frame=map&show=/h/update&view=top")
    world.should_see("wheel")
    ready = """
const view = getElement(Number(document.querySelector('.rosz-scene').id.slice(1)));
let count = 0;
view.scene.traverse((one) => { count += one.handle ? 1 : 0; });
if (count < 2 || view.camera.position.z < 11.9) return null;
const at = view.camera.position.clone().set(2.3, 0, 0).project(view.camera);
const box = view.renderer.domElement.getBoundingClientRect();
return [Math.round(at.x * box.width / 2), Math.round(-at.y * box.height / 2)];
"""
    eventually(lambda: world.ask(ready), "the handles, from above")
    canvas = world.browser.find_element("css selector", ".rosz-scene canvas")

    def turned() -> bool:
        place = world.ask(ready)
        if place is None:
            return False
        across, down = place
        keys: Any = ActionChains(world.browser, duration=50)
        keys.move_to_element_with_offset(canvas, across, down).pause(_STEP).click_and_hold()
        keys.move_by_offset(-across // 4, -across // 2).pause(_STEP)
        keys.move_by_offset(-across // 4, 0).pause(_STEP).release().perform()
        return any(abs(one.pose.orientation.z) > 0.1 for one in got)

    eventually(turned, "a turn that arrives")
    for one in [one for one in got if one.event_type == one.POSE_UPDATE]:
        assert (one.marker_name, one.control_name) == ("wheel", "turn")
        assert one.pose.position.x == pytest.approx(0.0, abs=1e-6)
        assert one.pose.orientation.x == pytest.approx(0.0, abs=1e-6)

    def pressed() -> bool:
        ActionChains(world.browser).move_to_element(canvas).click().perform()
        return any(one.event_type == one.BUTTON_CLICK for one in got)

    eventually(pressed, "a click that arrives")
    assert world.messages() == []
