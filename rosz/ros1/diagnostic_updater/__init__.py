"""diagnostic_updater: a node's own diagnostics on /diagnostics (ROS wiki, diagnostic_updater).

May import rospy and message classes. ``import *`` gives the names that ROS 1's gives.
"""

from __future__ import annotations

import http.client as httplib
import threading

from rosz.msgs.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rosz.ros1 import rospy
from rosz.ros1.diagnostic_updater._diagnostic_status_wrapper import (
    ERROR,
    OK,
    WARN,
    DiagnosticStatusWrapper,
)
from rosz.ros1.diagnostic_updater._diagnostic_updater import (
    CompositeDiagnosticTask,
    DiagnosticTask,
    DiagnosticTaskVector,
    FunctionDiagnosticTask,
    Updater,
)
from rosz.ros1.diagnostic_updater._publisher import (
    DiagnosedPublisher,
    HeaderlessTopicDiagnostic,
    TopicDiagnostic,
)
from rosz.ros1.diagnostic_updater._update_functions import (
    FrequencyStatus,
    FrequencyStatusParam,
    Heartbeat,
    TimeStampStatus,
    TimeStampStatusParam,
)

__all__ = (
    "ERROR",
    "OK",
    "WARN",
    "CompositeDiagnosticTask",
    "DiagnosedPublisher",
    "DiagnosticArray",
    "DiagnosticStatus",
    "DiagnosticStatusWrapper",
    "DiagnosticTask",
    "DiagnosticTaskVector",
    "FrequencyStatus",
    "FrequencyStatusParam",
    "FunctionDiagnosticTask",
    "HeaderlessTopicDiagnostic",
    "Heartbeat",
    "KeyValue",
    "TimeStampStatus",
    "TimeStampStatusParam",
    "TopicDiagnostic",
    "Updater",
    "httplib",
    "rospy",
    "threading",
)
