#!/usr/bin/env python
import dynamic_reconfigure
import dynamic_reconfigure.client
import rospy
from dynamic_reconfigure import (
    DynamicReconfigureCallbackException,
    DynamicReconfigureParameterException,
)

CHANGES = [
    {},
    {"int_param": 7},
    {"int_param": "8", "double_param": "0.25", "bool_param": "false"},
    {"bool_param": "T", "str_param": 5},
    {"int_param": 1000, "double_param": -3},
    {"int_param": 3.9, "double_param": 1},
    {"size": "large"},
    {"size": "Small", "str_param": "gr\u00fc\u00df dich"},
    {"size": 7},
    {"int_param": 66},
    {"nope": 1},
    {"int_param": "x"},
    {"double_param": ""},
    {"int_param": 13},
]


def show(config):
    return sorted((name, value) for name, value in config.items())


if __name__ == "__main__":
    rospy.init_node("dynamic_client")
    rospy.wait_for_service("dynamic_tutorials/set_parameters")
    print(dynamic_reconfigure.find_reconfigure_services())
    try:
        dynamic_reconfigure.client.Client("nobody", timeout=0.1)
    except rospy.ROSException as error:
        print(str(error).split(" service")[0])
    client = dynamic_reconfigure.client.Client("dynamic_tutorials", timeout=60)
    print(show(client.get_configuration()))
    for one in client.get_parameter_descriptions(timeout=60):
        print(sorted((k, v) for k, v in one.items() if k != "edit_method"))
    print(client.get_group_descriptions()["name"], sorted(client.get_group_descriptions()))
    for changes in CHANGES:
        try:
            print(show(client.update_configuration(changes)))
        except DynamicReconfigureParameterException as error:
            print("parameter", str(error).split(": ")[0])
        except DynamicReconfigureCallbackException as error:
            print("callback", str(error).split(": ")[0])
    stored = rospy.get_param("/dynamic_tutorials")
    print(sorted(stored.items()))
    client.close()
    told = []
    other = dynamic_reconfigure.client.Client("/dynamic_tutorials", config_callback=told.append)
    other.get_configuration()
    while not told:
        rospy.sleep(0.01)
    print(show(told[0]) == show(other.get_configuration(timeout=60)))
    print(other.config_callback == told.append, other.get_description_callback())
