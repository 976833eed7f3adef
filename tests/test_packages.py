from __future__ import annotations

from pathlib import Path

import pytest

from rosz.environment import Environment, package_index
from rosz.errors import ExecutableNotFound, NotFoundError, PackageError, PackageNotFound, UsageError
from rosz.packages import PackageIndex


def make(folder: Path, name: str, *, executables: tuple[str, ...] = (), plain: str = "") -> Path:
    (folder / "scripts").mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package format='2'><name>{name}</name></package>")
    for executable in executables:
        file = folder / "scripts" / executable
        file.write_text("#!/bin/sh\n")
        file.chmod(0o755)
    if plain:
        (folder / "scripts" / plain).write_text("x")
    return folder


def test_finds_packages_at_any_depth_and_first_root_wins(tmp_path: Path) -> None:
    first = make(tmp_path / "one" / "deep" / "folder", "alpha")
    make(tmp_path / "two" / "alpha", "alpha")
    beta = make(tmp_path / "two" / "b", "beta")
    make(beta / "inner", "hidden")
    index = PackageIndex([tmp_path / "one", tmp_path / "two"])
    assert index.find("alpha").path == first
    assert index.find("beta").path == beta
    assert index.names() == ["alpha", "beta"]
    with pytest.raises(PackageNotFound, match="did you mean 'alpha'"):
        index.find("alfa")
    with pytest.raises(PackageNotFound, match="searched"):
        index.find("hidden")


def test_the_nearer_of_two_of_a_name_wins(tmp_path: Path) -> None:
    make(tmp_path / "definitions" / "alpha", "alpha")
    near = make(tmp_path / "sources", "alpha")
    make(tmp_path / "others" / "alpha", "beta")
    index = PackageIndex([tmp_path])
    assert index.names() == ["alpha", "beta"]
    assert index.find("alpha").path == near


def test_a_root_may_be_a_package(tmp_path: Path) -> None:
    make(tmp_path / "p", "solo")
    assert PackageIndex([tmp_path / "p"]).find("solo").path == tmp_path / "p"


def test_entry_points_as_expressions(tmp_path: Path) -> None:
    folder = make(tmp_path / "p", "demo")
    (folder / "setup.py").write_text(
        "package_name = 'demo'\nnodes = package_name + '.nodes'\n"
        "more = [f'a = {package_name}.a:main', 'b = ' + nodes + '.b:main']\n"
        "more = more + ['not one']\n"
        "setup(entry_points={'console_scripts': ['c=demo.c:main', ['d='\n"
        "    'demo.d:main'], *more]})\n"
    )
    for name in ("a", "nodes/b", "c", "d"):
        (folder / "demo" / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / "demo" / f"{name}.py").touch()
    (package,) = PackageIndex([tmp_path]).packages()
    assert package.executables() == ["a", "b", "c", "d"]
    assert package.executable("b") == folder / "demo/nodes/b.py:main"
    (folder / "setup.py").write_text("setup(entry_points={'console_scripts': 'a = demo.a:run'})")
    (package,) = PackageIndex([tmp_path]).packages()
    assert package.executable("a") == folder / "demo/a.py:run"


@pytest.mark.parametrize(
    "text",
    [
        "\n".join(
            ["a = 'x'", *["a = a + a"] * 60, "setup(e={'console_scripts': [a, 'b=c:main']})"]
        ),
        f"setup(e={{'console_scripts': ['a=b:main' + {' + '.join(['x'] * 5000)}]}})",
        f"a = {'(' * 150}1{')' * 150}",
        "a = 1\0",
    ],
    ids=["doubled", "deep", "brackets", "null"],
)
def test_a_hostile_setup_py(tmp_path: Path, text: str) -> None:
    """It names what it can, within bounds."""
    folder = make(tmp_path / "p", "demo")
    (folder / "c.py").touch()
    (folder / "setup.py").write_text(text)
    (package,) = PackageIndex([tmp_path]).packages()
    assert package.executables() in ([], ["b"])


def test_ignored_folders(tmp_path: Path) -> None:
    make(tmp_path / "a", "alpha")
    (tmp_path / "a" / "CATKIN_IGNORE").touch()
    make(tmp_path / "off" / "b", "beta")
    (tmp_path / "off" / "COLCON_IGNORE").touch()
    assert PackageIndex([tmp_path]).names() == []


@pytest.mark.parametrize(
    ("text", "reason"),
    [("<package><name>a</package>", r"package\.xml:1:"), ("<robot/>", "expected <package>")],
)
def test_a_bad_manifest_is_named(tmp_path: Path, text: str, reason: str) -> None:
    (tmp_path / "odd").mkdir()
    (tmp_path / "odd" / "package.xml").write_text(text)
    make(tmp_path / "good", "good")
    index = PackageIndex([tmp_path])
    assert index.names() == ["good"]
    with pytest.raises(PackageError, match=reason):
        index.find("odd")
    assert [error.path for error in index.broken] == [str(tmp_path / "odd" / "package.xml")]


def test_executables(tmp_path: Path) -> None:
    make(tmp_path / "p", "p", executables=("talker.py", "listener.py"), plain="data.py")
    package = PackageIndex([tmp_path]).find("p")
    assert package.executables() == ["listener.py", "talker.py"]
    assert package.executable("talker.py") == tmp_path / "p" / "scripts" / "talker.py"
    with pytest.raises(ExecutableNotFound, match=r"chmod \+x .*data\.py"):
        package.executable("data.py")
    with pytest.raises(ExecutableNotFound, match=r"did you mean 'talker\.py'"):
        package.executable("talkr.py")
    assert package.file("data.py").is_file()
    with pytest.raises(NotFoundError, match="has no file"):
        package.file("none.launch")


@pytest.mark.parametrize("folders", [("launch", "old"), ("", "old")])
def test_files_of_one_name_are_listed(tmp_path: Path, folders: tuple[str, str]) -> None:
    make(tmp_path / "p", "p")
    files = [tmp_path / "p" / folder / "a.launch" for folder in folders]
    for file in files:
        file.parent.mkdir(exist_ok=True)
        file.write_text("<launch/>")
    package = PackageIndex([tmp_path]).find("p")
    with pytest.raises(NotFoundError) as caught:
        package.file("a.launch")
    assert str(caught.value) == (
        f"package 'p' has 2 files named 'a.launch': {files[0]}, {files[1]}; give the path of one"
    )
    assert package.file("old/a.launch") == files[1]
    files[0].chmod(0o755)
    assert package.file("a.launch") == files[1]


def test_a_slip_in_the_name_of_what_is_not_executable_yet(tmp_path: Path) -> None:
    make(tmp_path / "p", "p", plain="talker.py")
    with pytest.raises(ExecutableNotFound, match=r"has no executable .* mean 'talker\.py'\?"):
        PackageIndex([tmp_path]).find("p").executable("talkr.py")


def test_an_install_space_keeps_executables_apart(tmp_path: Path) -> None:
    make(tmp_path / "share" / "p", "p")
    program = tmp_path / "lib" / "p" / "node"
    program.parent.mkdir(parents=True)
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    assert PackageIndex([tmp_path / "share"]).find("p").executable("node") == program


def test_environment_reads_paths_and_workspace(tmp_path: Path) -> None:
    source = tmp_path / "ws" / "src"
    make(source / "p", "p")
    environ = {"HOME": "/home/u", "ROSZ_PACKAGE_PATH": "/x", "ROS_PACKAGE_PATH": "/y:/x"}
    found = Environment.read(environ, source / "p" / "scripts")
    assert found.package_roots == (Path("/x"), Path("/y"), source)
    assert found.home == Path("/home/u/.ros")
    assert found.log_dir == Path("/home/u/.ros/log")
    assert package_index(found).find("p").path == source / "p"


def test_shipped_packages_are_found(tmp_path: Path) -> None:
    index = package_index(Environment.read({"HOME": str(tmp_path)}, tmp_path))
    assert index.find("std_msgs").file("String.msg").is_file()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("ROS_DOMAIN_ID", "x"),
        ("ROS_DOMAIN_ID", "233"),
        ("ROSZ_MODE", "mesh"),
        ("ROSZ_SHM", "-1"),
        ("ROSZ_MULTICAST", "maybe"),
        ("ROSZ_COMPLETION_TIMEOUT", "soon"),
        ("ROSZ_RENDEZVOUS", "bogus"),
        ("ROSZ_RENDEZVOUS", "localhost:7447"),
        ("ROSZ_RENDEZVOUS", "tcp/localhost"),
        ("ROSZ_RENDEZVOUS", "tcp/localhost:77777"),
        ("ROSZ_RENDEZVOUS", "tpc/localhost:7447"),
        ("ROSZ_RENDEZVOUS", "unixsock-stream/"),
        ("ROSZ_CONNECT", "robot"),
        ("ROSZ_LISTEN", "0.0.0.0"),
    ],
)
def test_meaningless_settings_are_refused(tmp_path: Path, name: str, value: str) -> None:
    with pytest.raises(UsageError, match=f"{name} is '{value}'; expected "):
        Environment.read({name: value}, tmp_path)


@pytest.mark.parametrize(
    "endpoint",
    ["tcp/[::1]:7447", "udp/robot:1?rel=1", "tls/robot:7447#iface=eth0", "unixsock-stream//a/z"],
)
def test_endpoints_as_zenoh_has_them(tmp_path: Path, endpoint: str) -> None:
    variables = {"ROSZ_RENDEZVOUS": endpoint, "ROSZ_CONNECT": f"tcp/base:7447, {endpoint}"}
    found = Environment.read(variables, tmp_path)
    assert found.rendezvous == endpoint
    assert found.connect == ("tcp/base:7447", endpoint)


def test_switches(tmp_path: Path) -> None:
    found = [Environment.read({"ROSZ_MULTICAST": value}, tmp_path).multicast for value in "10"]
    assert found == [True, False]
    assert not Environment.read({}, tmp_path).multicast


@pytest.mark.parametrize(
    ("variables", "color"),
    [({}, True), ({"TERM": "xterm"}, True), ({"TERM": "dumb"}, False), ({"NO_COLOR": "1"}, False)],
)
def test_who_wants_no_colours(tmp_path: Path, variables: dict[str, str], color: bool) -> None:
    assert Environment.read(variables, tmp_path).color is color
