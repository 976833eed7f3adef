// The C++ nodes of the lab's package pub_sub: the program is the one whose name it is called by.
#include <cstdlib>
#include <string>

#include "pub_sub/Num.h"
#include "pub_sub/Reset.h"
#include "ros/ros.h"

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

void counterCallback(const pub_sub::Num::ConstPtr& msg) {
  ROS_INFO("I counted: [%ld]", (long int)msg->num);
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
  const std::string path = argv[0];
  const std::string name = path.substr(path.rfind('/') + 1);
  return name == "pub" ? pub(argc, argv) : name == "sub" ? sub(argc, argv) : client(argc, argv);
}
