"""A node of the world: settings to reconfigure, a logger, and an end that can be asked for."""

from __future__ import annotations

import rosz
from rosz.msgs.std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse
from rosz.reconfigure import Choice, Description, Server, Setting, enumeration

SIZES = enumeration([Choice("small", 0), Choice("large", 2)])
DESCRIPTION = Description(
    [
        Setting("gain", 0.5, "how strong", min=0.0, max=10.0),
        Setting("steps", 50, "how many"),
        Setting("size", 0, "which", edit_method=SIZES),
        Setting("label", "hello", "what to show"),
        Setting("enabled", True, "whether"),
    ]
)


def main() -> None:
    """Serve until the end."""
    with rosz.Node("robot", namespace="/arm") as node:
        Server(node, DESCRIPTION)
        node.service("fail", SetBool, refuse)
        node.timer(0.05, lambda _: node.log.warning("it hurts"))
        print("ready", flush=True)
        node.spin()


def refuse(_: SetBoolRequest) -> SetBoolResponse:
    raise ValueError("not now")


if __name__ == "__main__":
    main()
