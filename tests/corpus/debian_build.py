"""Build packages' Python modules with Debian's genpy; see `devel`."""

# mypy: ignore-errors
from __future__ import annotations

import contextlib
import io
import json
import os
import re
import runpy
import sys
from pathlib import Path
from typing import Any

import genpy.generate_initpy
import genpy.generator

_MD5 = re.compile(r"_md5sum\s*=\s*['\"](\w+)")
_LEADING = """\
from pkgutil import extend_path as _extend_path
from sys import path as _path
_path.insert(0, {source!r})
__path__ = _extend_path(__path__, __name__)
del _path[0]
import os as _os
_file = _os.path.join({source!r}, {inner!r}, "__init__.py")
if _os.path.exists(_file):
    with open(_file) as _opened:
        exec(compile(_opened.read(), _file, "exec"))
"""


def build(job: dict) -> dict:
    """Build one package; return the md5 or the error of each type."""
    found = {}
    out = Path(job["out"])
    for kind, generator in (
        ("msg", genpy.generator.MsgGenerator()),
        ("srv", genpy.generator.SrvGenerator()),
    ):
        if not job[kind]:
            continue
        folder = out / kind
        folder.mkdir(parents=True, exist_ok=True)
        for file in job[kind]:
            base = Path(file).stem
            name = f"{job['package']}/{base}"
            try:
                with contextlib.redirect_stdout(io.StringIO()) as said:
                    arguments = (job["package"], [file], str(folder), job["search"])
                    failed = generator.generate_messages(*arguments)
                text = "" if failed else (folder / f"_{base}.py").read_text()
                found[f"{kind} {name}"] = f"error: {said.getvalue()}"[:300]
                for md5 in _MD5.findall(text):  # the last one is the service's own
                    found[f"{kind} {name}"] = md5
            except BaseException as error:  # noqa: BLE001  # this type has no module there
                found[f"{kind} {name}"] = f"error: {type(error).__name__}: {error}"[:300]
        with contextlib.redirect_stdout(io.StringIO()):
            genpy.generate_initpy.write_modules(str(folder))
    (out / "__init__.py").touch()
    configure(job)
    lead(job)
    return found


def configure(job: dict) -> None:
    """Generate the modules of dynamic_reconfigure."""
    for file in job["cfg"]:
        folder = Path(job["out"])
        if os.fork() == 0:
            sys.path[:0] = [str(Path(file).parent), *job["python_path"].split(":")]
            sys.argv = [file, job["templates"], str(folder), str(folder), str(folder)]
            run(file)
            os._exit(0)
        os.wait()


def run(script: str) -> None:
    """Run a script of a package silently; if it fails, what it did until then counts."""
    with contextlib.ExitStack() as stack:
        null = stack.enter_context(Path(os.devnull).open("w"))
        stack.enter_context(contextlib.redirect_stdout(null))
        stack.enter_context(contextlib.redirect_stderr(null))
        stack.enter_context(contextlib.suppress(BaseException))
        runpy.run_path(script, run_name="__main__")


def lead(job: dict) -> None:
    """Write what leads from the devel space to the packages of a setup.py."""
    setup = Path(job["source"], "setup.py")
    if not setup.exists():
        return
    for name, source in described(setup, job["python_path"]):
        target = Path(job["space"], *name.split("."))
        target.mkdir(parents=True, exist_ok=True)
        inner = "/".join(name.split("."))
        (target / "__init__.py").write_text(_LEADING.format(source=source, inner=inner))


def described(setup: Path, python_path: str) -> list:
    """Return the packages that a setup.py names, each with its folder."""
    reader, writer = os.pipe()
    if os.fork() == 0:
        os.close(reader)
        found = []

        def note(*_: Any, **options: Any) -> None:
            folders = options.get("package_dir", {})
            for name in options.get("packages", []):
                top = name.split(".")[0]
                if name in folders:  # its parent, when the folder has the name of the package
                    found.append((name, str((setup.parent / folders[name]).parent)))
                else:
                    found.append((name, str(setup.parent / folders.get(top, folders.get("", ".")))))

        import distutils.core

        with contextlib.suppress(ImportError):
            import setuptools

            setuptools.setup = note
        distutils.core.setup = note
        os.chdir(setup.parent)
        sys.argv = ["setup.py", "install"]
        sys.path[:0] = [str(setup.parent), *python_path.split(":")]
        run(str(setup))
        os.write(writer, json.dumps(found).encode())
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as pipe:
        text = pipe.read()
    os.wait()
    return json.loads(text or "[]")


if __name__ == "__main__":
    jobs = json.load(sys.stdin)
    for job in jobs:
        result = build(job)
        Path(job["out"], ".md5.json").write_text(json.dumps(result))
