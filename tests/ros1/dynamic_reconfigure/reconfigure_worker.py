"""Answers for Debian's dynamic_reconfigure, under the interpreter it is installed for.

Reads one JSON document with ``files`` (to run), ``folder`` (to write to) and ``states``; writes one
with what the generated modules hold, and what the library makes of it.
"""

# mypy: disable-error-code="import-not-found,import-untyped"
from __future__ import annotations

import contextlib
import importlib
import io
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import genpy
from dynamic_reconfigure import encoding
from dynamic_reconfigure.cfg import TestConfig

MANIFEST = """\
<package>
  <name>dynamic_reconfigure</name><version>1.7.3</version><description>-</description>
  <maintainer email="a@b.invalid">-</maintainer><license>BSD</license>
</package>
"""


def plain(value: Any) -> Any:
    if isinstance(value, genpy.Message):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, dict):
        return {name: plain(one) for name, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    return value


def templates(folder: Path) -> Path:
    """Make the templates, which the package lacks, of a module that was generated from them."""
    text = re.sub(
        r"(?m)^config_description = .*$",
        "config_description = $pycfgdata",
        Path(TestConfig.__file__).read_text(),
    )
    (folder / "templates").mkdir(parents=True)
    (folder / "templates" / "ConfigType.py.template").write_text(
        re.sub(r"(?m)^Test_.*\n", "", text)
    )
    for name in ("ConfigType.h", "GroupClass.h"):
        (folder / "templates" / f"{name}.template").write_text("")
    return folder


def generate(file: str, folder: Path) -> Any:
    options = [str(folder / one) for one in ("bin", "cpp", "sample")]
    (folder / "bin").mkdir(exist_ok=True)
    # Debian's package has no manifest, which roslib.load_manifest() looks for.
    manifest = folder / "dynamic_reconfigure" / "package.xml"
    manifest.parent.mkdir(exist_ok=True)
    manifest.write_text(MANIFEST)
    subprocess.run(
        [sys.executable, file, str(folder), *options],
        check=True,
        cwd=folder,
        stdout=subprocess.DEVNULL,
        env={"PATH": "/usr/bin:/bin", "ROS_PACKAGE_PATH": str(folder)},
    )
    (folder / "sample" / "__init__.py").touch()
    sys.path[:0] = [str(folder / "sample" / "cfg")]
    return importlib.import_module(f"{Path(file).stem}Config")


def facts(module: Any, changes: dict[str, Any]) -> dict[str, Any]:
    hidden = ("__", "param", "extract_params")
    description = encoding.encode_description(module)
    decoded = encoding.decode_description(description)
    config = encoding.Config(module.defaults)
    config["groups"] = encoding.get_tree(description)
    first = encoding.initial_config(encoding.encode_config(config), module.config_description)
    message = encoding.encode_config(first)
    return {
        "module": {k: v for k, v in vars(module).items() if not k.startswith(hidden)},
        "extract_params": encoding.extract_params(module.config_description),
        "encode_description": plain(description),
        "decode_description": plain(decoded),
        "extract_decoded": plain(encoding.extract_params(decoded)),
        "get_tree": plain(encoding.get_tree(description)),
        "initial_config": plain(first),
        "encode_config": plain(message),
        "decode_config": plain(encoding.decode_config(message, decoded)),
        "decode_flat": plain(encoding.decode_config(message)),
        "changes": plain(encoding.encode_config(changes)),
        "order": list(first),
        "printed": repr(encoding.decode_config(message, decoded)),
    }


def main() -> None:
    request = json.load(sys.stdin)
    folder = templates(Path(request["folder"]))
    answer = {}
    with contextlib.redirect_stdout(io.StringIO()):
        for file in request["files"]:
            answer[Path(file).stem] = facts(generate(file, folder), request["changes"])
        answer["Test"] = facts(TestConfig, request["changes"])
    json.dump(answer, sys.stdout)


main()
