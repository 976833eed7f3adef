"""The Python part of catkin's devel space, for Debian's interpreter.

Each repository gets a folder for ``PYTHONPATH``: genpy's message modules, dynamic_reconfigure's,
and a package of each name in the setup.py files that leads to the source, as catkin writes them.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from oracle import PYTHON

from .packages import Corpus, Package, Repository

__all__ = ("Devel",)

_BUILD = Path(__file__).with_name("debian_build.py")
_SYSTEM = Path("/usr/share")
_PARTS = {
    "Goal": "{0}",
    "Result": "{1}",
    "Feedback": "{2}",
    "ActionGoal": "Header header\nactionlib_msgs/GoalID goal_id\n{name}Goal goal\n",
    "ActionResult": "Header header\nactionlib_msgs/GoalStatus status\n{name}Result result\n",
    "ActionFeedback": "Header header\nactionlib_msgs/GoalStatus status\n{name}Feedback feedback\n",
    "Action": "{name}ActionGoal action_goal\n{name}ActionResult action_result\n"
    "{name}ActionFeedback action_feedback\n",
}


class Devel:
    """The folders of a corpus.

    Args:
        corpus: The repositories.
        folder: Where to build.
    """

    def __init__(self, corpus: Corpus, folder: Path) -> None:
        self._corpus = corpus
        self._folder = folder

    def python_path(self, repository: Repository) -> str:
        """Return the ``PYTHONPATH`` of a repository."""
        workspace = self._corpus.workspace(repository, real=True)
        return ":".join(str(self._space(one)) for one in workspace)

    def build(self, repositories: list[Repository]) -> dict[str, Any]:
        """Build the folders of some repositories; return genpy's md5 or error of each type.

        The keys are ``repository:package/Type``.
        """
        jobs = [job for one in repositories for job in self._jobs(one)]
        output = self._folder / "md5.json"
        done = json.loads(output.read_text()) if output.exists() else {}
        jobs = [job for job in jobs if job["mark"] not in done]
        subprocess.run(
            [PYTHON, str(_BUILD)],
            input=json.dumps(jobs),
            text=True,
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for job in jobs:
            done[job["mark"]] = json.loads((Path(job["out"]) / ".md5.json").read_text())
        output.write_text(json.dumps(done, indent=1))
        wanted = {one.name for one in repositories}
        return {
            f"{mark.split(':')[0]}:{name}": md5
            for mark, types in done.items()
            if mark.split(":")[0] in wanted
            for name, md5 in types.items()
        }

    def _space(self, repository: Repository) -> Path:
        return self._folder / repository.name

    def _jobs(self, repository: Repository) -> Iterator[dict[str, Any]]:
        workspace = self._corpus.workspace(repository, real=True)
        search = self._search(workspace)
        for package in repository.packages.values():
            out = self._space(repository) / package.name
            configured = any((package.path / "cfg").glob("*.cfg"))
            if not (package.has_types or configured or (package.path / "setup.py").exists()):
                continue
            out.mkdir(parents=True, exist_ok=True)
            yield {
                "mark": f"{repository.name}:{package.name}",
                "package": package.name,
                "source": str(package.path),
                "space": str(self._space(repository)),
                "out": str(out),
                "msg": [*map(str, package.definitions("msg")), *_actions(package, out)],
                "srv": list(map(str, package.definitions("srv"))),
                "cfg": list(map(str, sorted((package.path / "cfg").glob("*.cfg")))),
                "templates": str(self._templates()),
                "search": search | {package.name: [str(package.path / "msg"), str(out / "action")]},
                "python_path": self.python_path(repository),
            }

    def _search(self, workspace: list[Repository]) -> dict[str, list[str]]:
        found = {path.parent.name: [str(path)] for path in _SYSTEM.glob("*/msg")}
        for one in reversed(workspace):
            for package in one.packages.values():
                if package.has_types:
                    actions = self._space(one) / package.name / "action"
                    list(_actions(package, actions.parent))
                    found[package.name] = [str(package.path / "msg"), str(actions)]
        return found

    def _templates(self) -> Path:
        for one in self._corpus.repositories:
            found = one.packages.get("dynamic_reconfigure")
            if found is not None:
                return found.path
        return _SYSTEM / "dynamic_reconfigure"


def _actions(package: Package, out: Path) -> Iterator[str]:
    """Yield the message definitions of a package's actions, which this writes."""
    for action in package.definitions("action"):
        sections: list[list[str]] = [[]]
        for line in action.read_text("utf-8", "replace").splitlines():
            if line.strip() == "---":
                sections.append([])
            else:
                sections[-1].append(line)
        texts = ["\n".join(section) + "\n" for section in [*sections, [], []]]
        for part, text in _PARTS.items():
            file = out / "action" / f"{action.stem}{part}.msg"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(
                text.format(*texts, name=action.stem) if "name" in text else texts[int(text[1])]
            )
            yield str(file)
