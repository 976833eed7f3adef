"""Message and service classes of the interfaces that come with rosz, generated from ``interfaces/``.

Each package has a module ``msg`` or ``srv`` or both: ``from rosz.msgs.std_msgs.msg import String``.
"""

from __future__ import annotations
