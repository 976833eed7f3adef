"""The system as pages observe and change it; nothing here imports NiceGUI.

What costs something is open only while a page uses it (`sharing`). Queues are bounded, and the
newest wins. Pages read what they show at their own pace, so that a slow browser holds nothing up.
"""

__all__ = ()
