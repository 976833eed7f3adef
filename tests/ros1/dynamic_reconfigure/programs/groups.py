#!/usr/bin/env python
import rospy
from dynamic_reconfigure.client import Client

if __name__ == "__main__":
    rospy.init_node("dynamic_client")
    client = Client("dynamic_tutorials")
    print(client.get_configuration())
    print(client.update_configuration({"joint": 5, "low": -9}))
    groups = client.get_group_descriptions()
    print([(name, sorted(one["groups"])) for name, one in sorted(groups["groups"].items())])
    print([one["name"] for one in client.get_parameter_descriptions()])
