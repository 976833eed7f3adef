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
        print(rospy.wait_for_message("status", DiagnosticStatus, 60).message)
        """) == [
        "['motor'] motor hot []",
        "['motor'] ['motor']",
        "2.0 wide",
        "expected at most 5 values, got 6",
        "hot",
    ]


def test_empty_messages_are_those_of_rospy(printed: Printed) -> None:
    assert printed("""
        import io
        import rospy
        from geometry_msgs.msg import PoseStamped
        from std_msgs.msg import String

        rospy.Message().serialize(io.BytesIO())
        out = io.BytesIO()
        String("kept").serialize(out)
        print(String().deserialize(out.getvalue()).data)
        print(PoseStamped(None, None).pose.position.x)
        for use in (lambda: rospy.AnyMsg().serialize(out), lambda: rospy.AnyMsg(1)):
            try:
                use()
            except rospy.ROSException as error:
                print(error)
        print(rospy.AnyMsg()._buff)
        """) == [
        "kept",
        "0.0",
        "AnyMsg is not initialized",
        "AnyMsg does not accept arguments",
        "None",
    ]


def test_messages_in_buffers_as_rospy_has_them(printed: Printed) -> None:
    assert printed("""
        import genpy
        import io
        import struct
        import rospy
        from rospy.msg import deserialize_messages, serialize_message
        from std_msgs.msg import Empty, Int8, String
        from geometry_msgs.msg import PointStamped

        buffer = io.BytesIO()
        for text in "abc":
            serialize_message(buffer, 0, String(text))
        written = [struct.pack("<IIc", 5, 1, text) for text in (b"a", b"b", b"c")]
        print(buffer.getvalue() == b"".join(written))
        buffer.write(b"\\5\\0\\0")
        queue = []
        deserialize_messages(buffer, queue, String, max_msgs=1)
        print([one.data for one in queue], buffer.tell())
        deserialize_messages(buffer, queue, String, queue_size=1)
        print([one.data for one in queue], buffer.getvalue())
        stamped = PointStamped()
        stamped.header.frame_id = None
        serialize_message(io.BytesIO(), 7, stamped)
        print(stamped.header.seq, stamped.header.frame_id)
        try:
            deserialize_messages(None, queue, String)
        except genpy.DeserializationError as error:
            print(error)
        any = rospy.AnyMsg().deserialize("text")
        out = io.StringIO()
        rospy.Message().serialize(out)
        Empty().serialize(out)
        print(any._buff, repr(out.getvalue()), rospy.Message().deserialize(""))
        """) == [
        "True",
        "['a'] 21",
        "['c'] b'\\x05\\x00\\x00'",
        "7 0",
        "std_msgs/String: there is no buffer, or no list for messages",
        "text '' ",
    ]


def test_bytes_are_signed(printed: Printed) -> None:
    assert printed("""
        import rospy
        from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
        from std_msgs.msg import ByteMultiArray

        rospy.init_node("signed")
        out = rospy.Publisher("levels", DiagnosticArray, queue_size=1, latch=True)
        out.publish(DiagnosticArray(status=[DiagnosticStatus(level=-127)]))
        print(rospy.wait_for_message("levels", DiagnosticArray, 60).status[0].level)
        out = rospy.Publisher("many", ByteMultiArray, queue_size=1, latch=True)
        out.publish(ByteMultiArray(data=[-1, 2]))
        print(rospy.wait_for_message("many", ByteMultiArray, 60).data)
        """) == ["-127", "(-1, 2)"]
