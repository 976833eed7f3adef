"""Constants of definitions as choices of forms."""

from __future__ import annotations

from typing import Any

import pytest

from rosz.msgs.diagnostic_msgs.msg import DiagnosticStatus
from rosz.msgs.geometry_msgs.msg import Pose
from rosz.msgs.rcl_interfaces.msg import LoggerLevel
from rosz.msgs.sensor_msgs.msg import BatteryState
from rosz.msgs.shape_msgs.msg import SolidPrimitive
from rosz.msgs.visualization_msgs.msg import InteractiveMarkerControl, Marker
from rosz.web.model.forms import form_fields


def choices(cls: type[Any]) -> dict[str, dict[Any, str]]:
    return {one.name: one.choices for one in form_fields(cls) if one.choices}


@pytest.mark.parametrize(
    ("cls", "field", "some"),
    [
        (Marker, "type", {0: "ARROW", 9: "TEXT_VIEW_FACING", 11: "TRIANGLE_LIST"}),
        (Marker, "action", {0: "ADD, MODIFY", 2: "DELETE", 3: "DELETEALL"}),
        (InteractiveMarkerControl, "orientation_mode", {0: "INHERIT", 2: "VIEW_FACING"}),
        (InteractiveMarkerControl, "interaction_mode", {0: "NONE", 9: "MOVE_ROTATE_3D"}),
        (LoggerLevel, "level", {20: "LOG_LEVEL_INFO"}),
        (DiagnosticStatus, "level", {1: "WARN", 3: "STALE"}),
        (BatteryState, "power_supply_status", {1: "POWER_SUPPLY_STATUS_CHARGING"}),
        (BatteryState, "power_supply_health", {2: "POWER_SUPPLY_HEALTH_OVERHEAT"}),
        (SolidPrimitive, "type", {1: "BOX", 5: "PRISM"}),
    ],
)
def test_constants_are_offered_by_name(cls: type[Any], field: str, some: dict[int, str]) -> None:
    found = choices(cls)[field]
    assert some.items() <= found.items()


def test_other_fields_stay_numbers() -> None:
    assert choices(Marker).keys() == {"type", "action"}
    assert choices(BatteryState).keys() == {
        "power_supply_status",
        "power_supply_health",
        "power_supply_technology",
    }
    assert choices(Pose) == {}
