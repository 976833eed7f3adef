// The C++ nodes of the course: the program is the one of the name of its file.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <dynamic_reconfigure/server.h>
#include <pub_sub/parametersConfig.h>
#include <std_msgs/String.h>

#include "pub_sub/Num.h"
#include "pub_sub/Reset.h"
#include "ros/ros.h"

#define main abc_node
#include "abc_code.cpp"
#undef main

using namespace boost::placeholders;  // the Boost of the lab had _1 and _2 without it

bool reset_callback(int* count, pub_sub::Reset::Request& req, pub_sub::Reset::Response& res) {
  res.old_count = *count;
  *count = req.new_count;
  ROS_INFO("request: new_count=%ld", (long int)req.new_count);
  ROS_INFO("sending back response: old_count=%ld", (long int)res.old_count);
  return true;
}

int pub(int argc, char** argv) {
  ros::init(argc, argv, "pub");
  ros::NodeHandle n;
  int count = 0;
  ros::Publisher counter_pub = n.advertise<pub_sub::Num>("counter", 1000);
  ros::ServiceServer service =
      n.advertiseService<pub_sub::Reset::Request, pub_sub::Reset::Response>(
          "reset", boost::bind(&reset_callback, &count, _1, _2));
  ros::Rate loop_rate(10);
  while (ros::ok()) {
    pub_sub::Num count_msg;
    count_msg.num = count;
    counter_pub.publish(count_msg);
    ros::spinOnce();
    loop_rate.sleep();
    ++count;
  }
  return 0;
}

std::string in_format(int count, int fmt) {
  char text[32];
  std::snprintf(text, sizeof text, fmt == 1 ? "%x" : fmt == 2 ? "%o" : "%d", count);
  return text;
}

// Counts in numbers or in texts until the node ends.
void tell(ros::NodeHandle& n, const bool* mode, const int* fmt) {
  ros::Publisher counter_pub = n.advertise<pub_sub::Num>("counter", 1000);
  ros::Publisher text_pub = n.advertise<std_msgs::String>("counter_text", 1000);
  ros::Rate loop_rate(10);
  for (int count = 0; ros::ok(); ++count) {
    pub_sub::Num count_msg;
    count_msg.num = count;
    std_msgs::String text_msg;
    text_msg.data = in_format(count, *fmt);
    if (*mode)
      counter_pub.publish(count_msg);
    else
      text_pub.publish(text_msg);
    ros::spinOnce();
    loop_rate.sleep();
  }
}

int static_pub(int argc, char** argv) {
  ros::init(argc, argv, "pub");
  ros::NodeHandle n;
  bool mode;
  n.getParam("/mode", mode);
  const int fmt = 0;
  tell(n, &mode, &fmt);
  return 0;
}

void callback(bool* mode, int* fmt, pub_sub::parametersConfig& config, uint32_t level) {
  ROS_INFO("Reconfigure request: mode=%s fmt=%d level=%u", config.mode ? "True" : "False",
           config.fmt, level);
  *mode = config.mode;
  *fmt = config.fmt;
}

int dynamic_pub(int argc, char** argv) {
  ros::init(argc, argv, "pub_sub");
  ros::NodeHandle n;
  bool mode = true;
  int fmt = 0;
  dynamic_reconfigure::Server<pub_sub::parametersConfig> dynServer;
  dynamic_reconfigure::Server<pub_sub::parametersConfig>::CallbackType f;
  f = boost::bind(&callback, &mode, &fmt, _1, _2);
  dynServer.setCallback(f);
  tell(n, &mode, &fmt);
  return 0;
}

void counterCallback(const pub_sub::Num::ConstPtr& msg) {
  ROS_INFO("I counted: [%d]", msg->num);
}

int sub(int argc, char** argv) {
  ros::init(argc, argv, "sub");
  ros::NodeHandle n;
  ros::Subscriber counter_sub = n.subscribe("counter", 1000, counterCallback);
  ros::spin();
  return 0;
}

int client(int argc, char** argv) {
  ros::init(argc, argv, "reset_client");
  if (argc != 2) {
    ROS_INFO("usage: client new_count");
    return 1;
  }
  ros::NodeHandle n;
  ros::ServiceClient client = n.serviceClient<pub_sub::Reset>("reset");
  pub_sub::Reset srv;
  srv.request.new_count = atoll(argv[1]);
  if (client.call(srv)) {
    ROS_INFO("Old count: %ld", (long int)srv.response.old_count);
  } else {
    ROS_ERROR("Failed to call service reset");
    return 1;
  }
  return 0;
}

int main(int argc, char** argv) {
  const std::string name = std::filesystem::read_symlink("/proc/self/exe").filename();
  if (name == "abc_node") return abc_node(argc, argv);
  if (name == "static_pub") return static_pub(argc, argv);
  if (name == "dynamic_pub") return dynamic_pub(argc, argv);
  return name == "pub" ? pub(argc, argv) : name == "sub" ? sub(argc, argv) : client(argc, argv);
}
