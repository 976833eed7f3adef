"""tf and tf2_ros in programs of their own."""

from __future__ import annotations

from network import Network

ROBOT = """
    import rosz.ros1
    import rospy, tf, tf2_ros
    from geometry_msgs.msg import TransformStamped
    rospy.init_node("robot")
    static = tf2_ros.StaticTransformBroadcaster()
    fixed = TransformStamped()
    fixed.header.frame_id, fixed.child_frame_id = "base", "laser"
    fixed.transform.translation.z = 0.5
    fixed.transform.rotation.w = 1.0
    static.sendTransform(fixed)
    broadcaster = tf.TransformBroadcaster()
    turn = tf.transformations.quaternion_from_euler(0, 0, 1.5707963267948966)
    print("begins")
    while not rospy.is_shutdown():
        broadcaster.sendTransform((1, 2, 0), turn, rospy.Time.now(), "base", "map")
        rospy.sleep(0.02)
"""


def test_tf_and_tf2(network: Network) -> None:
    network.program(ROBOT).wait_for("begins")
    viewer = network.program(
        """
        import rosz.ros1
        import rospy, tf, tf2_ros, tf2_geometry_msgs
        from geometry_msgs.msg import PointStamped, PoseStamped
        rospy.init_node("viewer")
        listener = tf.TransformListener()
        listener.waitForTransform("/map", "/laser", rospy.Time(0), rospy.Duration(60))
        position, rotation = listener.lookupTransform("/map", "/laser", rospy.Time(0))
        print([round(x, 3) for x in position], [round(x, 3) for x in rotation])
        point = PointStamped()
        point.header.frame_id, point.point.x = "laser", 1.0
        moved = listener.transformPoint("map", point)
        print(moved.header.frame_id, round(moved.point.x, 3), round(moved.point.y, 3))
        pose = PoseStamped()
        pose.header.frame_id, pose.pose.orientation.w = "laser", 1.0
        print(round(listener.transformPose("map", pose).pose.position.y, 3))
        print(listener.frameExists("/laser"), sorted(listener.getFrameStrings()))
        try:
            listener.lookupTransform("/map", "/nothing", rospy.Time(0))
        except (tf.LookupException, tf.ConnectivityException, tf.ExtrapolationException) as error:
            print(error)
        try:
            listener.waitForTransform("map", "nothing", rospy.Time(0), rospy.Duration(0.1))
        except tf.Exception as error:
            print(error)
        buffer = tf2_ros.Buffer()
        tf2_ros.TransformListener(buffer)
        found = buffer.lookup_transform("map", "laser", rospy.Time(0), rospy.Duration(60))
        print(found.header.frame_id, found.child_frame_id, found.transform.translation.z)
        print(round(buffer.transform(point, "map").point.y, 3))
        later = rospy.Time.now() + rospy.Duration(0.2)
        print(buffer.can_transform("map", "base", later, rospy.Duration(60)))
        try:
            buffer.transform(3, "map")
        except tf2_ros.TypeException as error:
            print(error)
        """
    )
    assert viewer.exit_code() == 0, viewer.output
    assert viewer.lines == [
        "[1.0, 2.0, 0.5] [0.0, 0.0, 0.707, 0.707]",
        "map 1.0 3.0",
        "2.0",
        "True ['base', 'laser']",
        '"nothing" passed to lookupTransform argument source_frame does not exist. ',
        "canTransform: source_frame nothing does not exist.",
        "map laser 0.5",
        "3.0",
        "True",
        "cannot transform int; known: PointStamped, PoseStamped, Vector3Stamped, WrenchStamped",
    ]


def test_nodes_of_rclpy(network: Network) -> None:
    program = network.program(
        """
        import rosz.ros1
        import rclpy, rospkg.common, tf_conversions
        from geometry_msgs.msg import TransformStamped
        from rclpy.duration import Duration
        from rclpy.time import Time
        from tf.msg import tfMessage
        from tf2_ros import Buffer, TransformBroadcaster, TransformException, TransformListener
        from tf_transformations import euler_from_quaternion, quaternion_from_euler

        rclpy.init()
        node = rclpy.create_node("n")
        broadcaster = TransformBroadcaster(node)
        buffer = Buffer()
        listener = TransformListener(buffer, node)
        def tell():
            made = TransformStamped()
            made.header.stamp = node.get_clock().now().to_msg()
            made.header.frame_id, made.child_frame_id = "odom", "base"
            q = made.transform.rotation
            q.x, q.y, q.z, q.w = quaternion_from_euler(0, 0, 1)
            broadcaster.sendTransform(made)
        def look():
            try:
                found = buffer.lookup_transform("odom", "base", Time())
            except TransformException as error:
                node.get_logger().info(str(error), once=True)
                return
            q = found.transform.rotation
            print("yaw", round(euler_from_quaternion([q.x, q.y, q.z, q.w])[2], 3))
            print(buffer.can_transform("odom", "base", Time(), timeout=Duration(seconds=1.0)))
            rclpy.shutdown()
        node.create_timer(0.02, tell)
        node.create_timer(0.02, look)
        rclpy.spin(node)
        """
    )
    assert program.exit_code() == 0, program.output
    assert program.lines[-2:] == ["yaw 1.0", "True"]


def test_transforms_that_rclpy_awaits(network: Network) -> None:
    program = network.program(
        """
        import rosz.ros1
        import rclpy
        from geometry_msgs.msg import TransformStamped
        from rclpy.time import Time
        from tf2_ros import Buffer

        rclpy.init()
        node = rclpy.create_node("n")
        buffer = Buffer(node=node)
        made = TransformStamped()
        made.header.frame_id, made.child_frame_id = "odom", "base"
        made.transform.translation.x = 2.0

        async def look():
            timer.cancel()
            node.create_timer(0.01, lambda: buffer.set_transform(made, "test"))
            found = await buffer.lookup_transform_async("odom", "base", Time())
            return found.transform.translation.x

        def begin():
            tasks.append(node.executor.create_task(look))

        timer = node.create_timer(0.01, begin)
        tasks = []
        while not (tasks and tasks[0].done()):
            rclpy.spin_once(node)
        print(tasks[0].result(), len(buffer.frames._waiters))
        future = buffer.wait_for_transform_async("odom", "laser", Time())
        print(future.done(), len(buffer.frames._waiters))
        future.cancel()
        print(len(buffer.frames._waiters))
        rclpy.spin_until_future_complete(
            node, buffer.wait_for_transform_async("odom", "base", Time())
        )
        rclpy.shutdown()
        """
    )
    assert program.exit_code() == 0, program.output
    assert program.lines == ["2.0 0", "False 1", "0"]


def test_buffers_of_other_nodes(network: Network) -> None:
    """A buffer serves its frames, and a buffer server looks transforms up for clients."""
    network.program(
        """
        import rosz.ros1
        import rospy, tf2_ros
        from geometry_msgs.msg import TransformStamped
        rospy.init_node("server")
        buffer = tf2_ros.Buffer()
        again = tf2_ros.Buffer()
        fixed = TransformStamped()
        fixed.header.frame_id, fixed.child_frame_id = "base", "laser"
        fixed.transform.translation.x, fixed.transform.rotation.w = 0.5, 1.0
        buffer.set_transform_static(fixed, "test")
        server = tf2_ros.BufferServer(buffer, "lookups")
        print("ready")
        rospy.spin()
        """
    ).wait_for("ready")
    client = network.program(
        """
        import rosz.ros1
        import rospy, tf2_ros, tf2_sensor_msgs
        from sensor_msgs import point_cloud2
        from std_msgs.msg import Header
        from tf2_msgs.srv import FrameGraph
        rospy.init_node("client")
        rospy.wait_for_service("/server/tf2_frames", 60)
        print(rospy.ServiceProxy("/server/tf2_frames", FrameGraph)().frame_yaml.splitlines()[:2])
        buffer = tf2_ros.BufferClient("lookups", timeout_padding=rospy.Duration(60))
        print(buffer.wait_for_server(rospy.Duration(60)))
        none = rospy.Duration(0)
        print(buffer.lookup_transform("base", "laser", rospy.Time(0)).transform.translation.x)
        zero = rospy.Time(0)
        found = buffer.lookup_transform_full("laser", zero, "base", zero, "base", none)
        print(found.transform.translation.x)
        print(buffer.can_transform("base", "nothing", zero, rospy.Duration.from_sec(0.05)))
        for frame in "nothing", "":
            try:
                buffer.lookup_transform("base", frame, zero)
            except tf2_ros.TransformException as error:
                print(isinstance(error, tf2_ros.LookupException), error)
        cloud = point_cloud2.create_cloud_xyz32(Header(frame_id="laser"), [(1, 2, 3)])
        print(list(point_cloud2.read_points(buffer.transform(cloud, "base"))))
        try:
            buffer.transform(cloud, "base", new_type=int)
        except tf2_ros.TypeException as error:
            print(error)
        """
    )
    assert client.exit_code() == 0, client.output
    assert client.lines == [
        """['laser: ', "  parent: 'base'"]""",
        "True",
        "0.5",
        "-0.5",
        "False",
        'True "nothing" passed to lookupTransform argument source_frame does not exist. ',
        "False Invalid argument passed to lookupTransform argument source_frame in tf2 frame_ids"
        " cannot be empty",
        "[(1.5, 2.0, 3.0)]",
        "cannot make of a message int; known: PointStamped, PoseStamped, Vector3Stamped,"
        " PointCloud2",
    ]
