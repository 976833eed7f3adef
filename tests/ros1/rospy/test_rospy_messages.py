"""Message classes as ROS 1 programs use them."""

from __future__ import annotations

from .rospy_programs import Printed


def test_programs_derive_classes(printed: Printed) -> None:
    assert printed("""
        import copy
        import rospy
        from diagnostic_msgs.msg import DiagnosticStatus
        from sensor_msgs.msg import CameraInfo

        class Wrapper(DiagnosticStatus):
            def __init__(self, *args, **kwds):
                DiagnosticStatus.__init__(self, *args, **kwds)
                self.own = [self.name]
            def merge(self, text):
                self.message += text

        class Inner(Wrapper):
            def __init__(self):
                super(Inner, self).__init__(name="motor")

        class Camera(CameraInfo):
            def __init__(self):
                CameraInfo.__init__(self, K=[2.0] * 9)
                self.lens = "wide"

        status = Inner()
        status.merge("hot")
        print(status.own, status.name, status.message, status.values)
        print(copy.deepcopy(status).own, copy.copy(status).own)
        print(Camera().K[0], Camera().lens)
        try:
            Wrapper(1, 2, 3, 4, 5, 6)
        except TypeError as error:
            print(error)
        rospy.init_node("derived")
        out = rospy.Publisher("status", DiagnosticStatus, queue_size=1, latch=True)
        out.publish(status)
        print(rospy.wait_for_message("status", DiagnosticStatus, 10).message)
        """) == [
        "['motor'] motor hot []",
        "['motor'] ['motor']",
        "2.0 wide",
        "expected at most 5 values, got 6",
        "hot",
    ]
