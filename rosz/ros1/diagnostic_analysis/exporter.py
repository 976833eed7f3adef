"""diagnostic_analysis.exporter: a CSV file for each status of a bag."""

from __future__ import annotations

import os
import sys
import tempfile
import time
from importlib import import_module
from io import StringIO
from pathlib import Path
from typing import Any

__all__ = ("LogExporter",)

_TOPIC = "/diagnostics"
_NOT_IN_FILE_NAMES = str.maketrans({" ": "_", "/": "__"} | dict.fromkeys("().#", ""))


class LogExporter:
    """Writes the diagnostics of a bag to CSV files, one for each status.

    A row has time, level, message, hardware ID, and the value of each key that came in any message.

    Args:
        output_dir: Folder of the files, which is made; a temporary one when None.
        logfile: The bag.
    """

    def __init__(self, output_dir: str | None, logfile: str) -> None:
        self._temp = output_dir is None
        self._stats: dict[str, dict[str, Any]] = {}
        self.logfile = logfile
        self.output_dir = output_dir or tempfile.mkdtemp()
        Path(self.output_dir).mkdir(parents=True, exist_ok=True)

    def remove_files(self) -> None:
        """Remove the files, and the folder if it is temporary."""
        for status in self._stats.values():
            Path(status["file_name"]).unlink()
        if self._temp:
            Path(self.output_dir).rmdir()

    def get_filename(self, name: str) -> str | None:
        """Return the file of a status; None if the bag has none of that name."""
        return self._stats[name]["file_name"] if name in self._stats else None

    def process_log(self) -> None:
        """Read the bag."""
        bag = import_module("rosbag").Bag(self.logfile)
        for topic, message, _ in bag.read_messages():
            self._update(topic, message)

    def finish_logfile(self) -> None:
        """Write the files."""
        for name, status in self._stats.items():
            path = Path(self.output_dir, f"{name.translate(_NOT_IN_FILE_NAMES)}.csv")
            keys = [key.replace(",", "").replace("\n", " ") for key in status["fields"]]
            with path.open("w") as file:
                file.write(",".join(["Timestamp", "Level", "Message", "Hardware ID", *keys]) + "\n")
                file.write(status["data_file"].getvalue())
            status["file_name"] = os.fspath(path)

    def _update(self, topic: str, message: Any) -> None:
        if topic != _TOPIC:
            sys.stderr.write(f"a message on {topic} is left out; expected {_TOPIC}\n")
            return
        moment = time.localtime(message.header.stamp.to_sec())
        for status in message.status:
            known = self._stats.get(status.name)
            if known is None:
                known = self._stats[status.name] = {
                    "fields": {},
                    "data_file": StringIO(),
                    "level": status.level,
                    "message": status.message,
                    "hardware_id": status.hardware_id,
                }
            fields: dict[str, int] = known["fields"]
            for detail in status.values:
                fields.setdefault(detail.key, len(fields))
            values = [""] * len(fields)
            for detail in status.values:
                values[fields[detail.key]] = detail.value.replace("\n", "  ").replace(",", " ")
            head = [
                time.strftime("%Y/%m/%d %H:%M:%S", moment),
                str(status.level),
                status.message.replace(",", " ").strip(),
                status.hardware_id.replace(",", " "),
            ]
            known["data_file"].write(",".join(head + values) + "\n")
