from field_msgs.msg import Track


def track(distances):
    return Track(distances=distances)
