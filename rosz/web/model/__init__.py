"""The system as pages observe and change it; nothing here imports NiceGUI.

What costs something is open only while a page uses it (`SharedResource`). Queues are bounded, and
the newest wins. Pages read what they show at their own pace, so that a slow browser holds nothing
up.
"""

from rosz.lifecycle import SharedResource
from rosz.web.model.actions import ActionRow, Actions, ActionUse, GoalRow, SentGoal
from rosz.web.model.bag_orders import BagCommand, BagOrder, BagReport, PlayOrder, RecordOrder
from rosz.web.model.bags import COMPRESSIONS, BagRun, Bags
from rosz.web.model.console import LogBook
from rosz.web.model.driving import VelocityPublisher
from rosz.web.model.floor import FloorPlan, find_floor
from rosz.web.model.forms import Form, FormField, form_of
from rosz.web.model.frames import Frames, read_frame
from rosz.web.model.launches import Launches, NodeOutput, RunningLaunch
from rosz.web.model.parameters import ParameterModel
from rosz.web.model.pictures import IMAGE_TYPES, ImageWatch
from rosz.web.model.plotting import Plot, split_fields
from rosz.web.model.reconfiguring import Reconfiguration
from rosz.web.model.sending import Sending, call_service
from rosz.web.model.system import Findings, System
from rosz.web.model.topic import FieldCondition, TopicWatch, message_tree
from rosz.web.model.traffic import Traffic
