"""The system as pages observe and change it; nothing here imports NiceGUI.

What costs something is open only while a page uses it (`Shared`). Queues are bounded, and the
newest wins. Pages read what they show at their own pace, so that a slow browser holds nothing up.
"""

from rosz.web.model.findings import Findings
from rosz.web.model.permission import Permission
from rosz.web.model.sharing import Shared
from rosz.web.model.system import System
from rosz.web.model.traffic import Traffic

__all__ = ("Findings", "Permission", "Shared", "System", "Traffic")
