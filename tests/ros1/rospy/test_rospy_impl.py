"""What publishers and subscribers of a topic share, and topics after the shutdown."""

from __future__ import annotations

from .rospy_programs import Printed


def test_the_shared_publisher_has_rospys_names(printed: Printed) -> None:
    assert printed("""
        import threading, time
        import rospy
        from std_msgs.msg import String
        rospy.init_node("shared")
        out = rospy.Publisher("x", String, queue_size=3, headers={"a": "b"})
        print(out.impl.headers, out.impl.queue_size, out.impl.closed, out.impl.resolved_name)
        came = threading.Event()
        went = threading.Event()
        links = []
        class Listener(rospy.SubscribeListener):
            def peer_subscribe(self, topic, publish, publish_to_it):
                links.append(publish_to_it)
                came.set()
            def peer_unsubscribe(self, topic, count):
                went.set()
        listener = Listener()
        out.impl.add_subscriber_listener(listener)
        got = []
        heard = threading.Event()
        def take(message, words):
            got.append((message.data, words))
            heard.set()
        subscriber = rospy.Subscriber("x", String)
        impl = subscriber.impl
        print(impl.callbacks, impl.ref_count, impl.queue_size)
        impl.add_callback(take, ["extra"])
        print(came.wait(60))
        links[0](String("welcome"))
        print(heard.wait(60), got)
        while not impl.get_num_connections():
            time.sleep(0.002)
        print(out.impl.has_connections(), out.impl.has_connection("/shared"),
              impl.get_num_connections(), listener in out.impl.subscriber_listeners)
        impl.remove_callback(take, ["extra"])
        try:
            impl.remove_callback(take, ["extra"])
        except KeyError as error:
            print("KeyError", error)
        subscriber.unregister()
        print(went.wait(60), impl.ref_count, impl.closed, subscriber.type, subscriber.name)
        try:
            impl.add_callback(take, None)
        except rospy.ROSException as error:
            print(error)
        out.impl.acquire()
        out.impl.release()
        out.impl.enable_latch()
        out.impl.subscriber_listeners.remove(listener)
        out.publish("kept")
        print(rospy.wait_for_message("x", String, 60).data, out.impl.latch.data)
        """) == [
        "{'a': 'b'} 3 False /x",
        "[] 1 None",
        "True",
        "True [('welcome', ['extra'])]",
        "True True 1 True",
        "KeyError 'no matching cb'",
        "True 0 True None /x",
        "subscriber [/x] has been closed",
        "kept kept",
    ]


def test_what_is_published_after_the_shutdown_is_dropped(printed: Printed) -> None:
    assert printed("""
        import rospy
        from std_msgs.msg import Header, Int8, String
        rospy.init_node("late")
        outs = [rospy.Publisher(n, t, queue_size=1, latch=n == "b")
                for n, t in (("a", String), ("b", String), ("c", Int8), ("d", Header))]
        rospy.signal_shutdown("over")
        for out, value in zip(outs, ("text", "text", 1000, 5)):
            print(out.publish(value) if out.type != "std_msgs/Header" else out.publish(Header()))
        late = rospy.Publisher("e", String, queue_size=1)
        print(late.publish("x"), late.get_num_connections())
        rospy.Subscriber("e", String, print).unregister()
        late.unregister()
        """) == ["None", "None", "None", "None", "None 0"]


def test_the_master_is_asked_while_the_node_goes(printed: Printed) -> None:
    assert printed("""
        import threading
        import rosgraph
        import rospy
        rospy.init_node("asking")
        asked = rosgraph.Master("asking").getSystemState, rospy.get_published_topics
        failed = []
        ended = threading.Event()
        def ask():
            while not ended.is_set():
                for call in asked:
                    try:
                        call()
                    except Exception as error:
                        failed.append(error)
        thread = threading.Thread(target=ask)
        thread.start()
        rospy.signal_shutdown("end")
        print(rospy.get_master().getSystemState()[0], len(asked[0]()))
        ended.set()
        thread.join()
        print(failed)
        """) == ["1 3", "[]"]


def test_names_of_modules_that_programs_use(printed: Printed) -> None:
    assert printed("""
        import rospy
        from rospy.impl import tcpros_service
        from std_srvs.srv import SetBoolResponse
        convert = tcpros_service.convert_return_to_response
        print(convert((True, "yes"), SetBoolResponse).message)
        print(issubclass(rospy.Service, tcpros_service.ServiceImpl))
        try:
            convert(None, SetBoolResponse)
        except rospy.ServiceException as error:
            print(error)
        print(rospy.core._in_shutdown)
        rospy.signal_shutdown("end")
        print(rospy.core._in_shutdown)
        try:
            rospy.core._in_shutdwn
        except AttributeError as error:
            print(error)
        """) == [
        "yes",
        "True",
        "service handler returned None",
        "False",
        "True",
        "module 'rospy.core' of rosz has no attribute '_in_shutdwn'",
    ]


def test_the_time_can_be_read_without_a_node(printed: Printed) -> None:
    assert printed("""
        import time
        import rospy
        from rospy.client import _Unspecified, load_command_line_node_params, myargv
        from rospy.names import scoped_name
        try:
            rospy.get_time()
        except rospy.ROSInitException:
            print("not yet")
        rospy.rostime.set_rostime_initialized(True)
        print(abs(rospy.get_time() - time.time()) < 60, rospy.rostime.is_rostime_initialized())
        print(rospy.Time.now().to_sec() > 1e9)
        rospy.rostime.set_rostime_initialized(False)
        print(rospy.rostime.is_rostime_initialized(), _Unspecified.__name__)
        print(load_command_line_node_params(["x", "_a:=1", "b:=c", "_d:=[1, 2]"]))
        print(myargv(["foo", "-bar:=baz", "a:=b"]))
        for words in (["_a:=b:=c"], ["_a:=["]):
            try:
                print(load_command_line_node_params(words))
            except rospy.ROSInitException as error:
                print(str(error)[:32])
        try:
            scoped_name("name", "/name")
        except rospy.ROSException:
            print("not global")
        """) == [
        "not yet",
        "True True",
        "True",
        "False _Unspecified",
        "{'a': 1, 'd': [1, 2]}",
        "['foo', '-bar:=baz']",
        "invalid command-line parameters:",
        "invalid command-line parameters:",
        "not global",
    ]


def test_log_messages_name_the_file_without_its_folder(printed: Printed) -> None:
    assert printed("""
        import os
        import rospy
        from rosgraph_msgs.msg import Log
        rospy.init_node("files")
        def say(_):
            rospy.loginfo("here")
        timer = rospy.Timer(rospy.Duration(0.1), say)
        found = rospy.wait_for_message("/rosout", Log, 60)
        timer.shutdown()
        timer.join()  # its lines would come between the words of this one
        print(found.file == os.path.basename(__file__), found.function)
        """)[-1:] == ["True say"]


def test_names_that_are_not_legal(printed: Printed) -> None:
    """ROS 1 warns of them; a blank keeps a node of ROS 1 from being registered."""
    assert printed("""
        import threading
        import warnings
        import rospy
        from std_msgs.msg import String
        warnings.filterwarnings("error", message=".*not a legal ROS base name")
        for name in ("motor-driver", "motor driver", "3d", "/a"):
            try:
                rospy.init_node(name)
            except Warning as warning:
                print(str(warning).partition("tools. ")[2])
            except ValueError as error:
                print(error)
        warnings.simplefilter("ignore")
        rospy.init_node("motor driver")
        print(rospy.get_name())
        heard = threading.Event()
        rospy.Subscriber("~left-wheel (1)", String, lambda message: heard.set())
        out = rospy.Publisher("~left-wheel (1)", String, queue_size=1)
        while not heard.wait(0.05):
            out.publish("on")
        print(out.name)
        try:
            rospy.Publisher("left*", String, queue_size=1)
        except ValueError as error:
            print(error)
        """) == [
        "The node is named 'motor_driver'.",
        "The node is named 'motor_driver'.",
        "The node is named 'node_3d'.",
        "namespaces are not allowed in node names",
        "/motor_driver",
        "/motor_driver/left-wheel (1)",
        "'/left*' is not a valid name: character '*' at position 6; expected letters, digits,"
        " '_' or '/'",
    ]
