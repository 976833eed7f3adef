#!/usr/bin/env python
PACKAGE = 'sample'
import roslib; roslib.load_manifest('dynamic_reconfigure')
import rospy
import sys

from dynamic_reconfigure.server import Server
from importlib import import_module

config_type = import_module(PACKAGE + '.cfg.' + sys.argv[1] + 'Config')


def callback(config, level):
    values = sorted((name, value) for name, value in config.items() if name != 'groups')
    print(values, level, config['groups']['state'])
    if config.get('int_param') == 66:
        config.str_param = 'decided'
        config['double_param'] = 0.125
    if config.get('int_param') == 13:
        return None
    return config


if __name__ == '__main__':
    rospy.init_node('dynamic_tutorials', anonymous=False)
    server = Server(config_type, callback)
    print(sorted(server.config)[:3], server.config == server.update_configuration({}))
    print('serving')
    sys.stdout.flush()
    rospy.spin()
    print('end')
