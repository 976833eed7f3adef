"""The system as pages observe and change it; nothing here imports NiceGUI.

What costs something is open only while a page uses it (`Shared`). Queues are bounded, and the
newest wins. Pages read what they show at their own pace, so that a slow browser holds nothing up.
"""

from rosz.web.model.actions import ActionRow, Actions, ActionUse, GoalRow, SentGoal
from rosz.web.model.bag_orders import BagCommand, BagOrder, BagReport, PlayOrder, RecordOrder
from rosz.web.model.bags import COMPRESSIONS, BagRow, BagRun, Bags
from rosz.web.model.calling import call_service, service_type
from rosz.web.model.console import LogBook
from rosz.web.model.driving import Driver
from rosz.web.model.findings import Findings
from rosz.web.model.floor import FloorPlan, find_floor
from rosz.web.model.forms import Form, FormField, form_of
from rosz.web.model.frames import Frames, read_frame
from rosz.web.model.launches import Launches, NodeOutput, RunningLaunch
from rosz.web.model.parameters import Parameters
from rosz.web.model.permission import Permission
from rosz.web.model.pictures import IMAGE_TYPES, ImageWatch, Pictures
from rosz.web.model.plotting import Plot, split_fields
from rosz.web.model.reconfiguring import Reconfiguration
from rosz.web.model.sending import Sending
from rosz.web.model.sharing import Shared
from rosz.web.model.system import System
from rosz.web.model.topic import Condition, TopicWatch, message_tree
from rosz.web.model.traffic import Traffic

__all__ = (
    "COMPRESSIONS",
    "IMAGE_TYPES",
    "ActionRow",
    "ActionUse",
    "Actions",
    "BagCommand",
    "BagOrder",
    "BagReport",
    "BagRow",
    "BagRun",
    "Bags",
    "Condition",
    "Driver",
    "Findings",
    "FloorPlan",
    "Form",
    "FormField",
    "Frames",
    "GoalRow",
    "ImageWatch",
    "Launches",
    "LogBook",
    "NodeOutput",
    "Parameters",
    "Permission",
    "Pictures",
    "PlayOrder",
    "Plot",
    "Reconfiguration",
    "RecordOrder",
    "RunningLaunch",
    "Sending",
    "SentGoal",
    "Shared",
    "System",
    "TopicWatch",
    "Traffic",
    "call_service",
    "find_floor",
    "form_of",
    "message_tree",
    "read_frame",
    "service_type",
    "split_fields",
)
