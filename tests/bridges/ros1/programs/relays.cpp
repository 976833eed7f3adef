// A nodelet that passes text on, in capitals.
#include <nodelet/nodelet.h>
#include <pluginlib/class_list_macros.hpp>
#include <ros/ros.h>
#include <std_msgs/String.h>

#include <cctype>

namespace relays
{
class Capitals : public nodelet::Nodelet
{
  void onInit() override
  {
    publisher_ = getPrivateNodeHandle().advertise<std_msgs::String>("out", 10);
    subscriber_ = getPrivateNodeHandle().subscribe("in", 10, &Capitals::pass, this);
    NODELET_INFO("ready");
  }

  void pass(const std_msgs::StringConstPtr& message)
  {
    std_msgs::String out;
    for (const char letter : message->data)
      out.data += std::toupper(letter);
    publisher_.publish(out);
  }

  ros::Publisher publisher_;
  ros::Subscriber subscriber_;
};
}

PLUGINLIB_EXPORT_CLASS(relays::Capitals, nodelet::Nodelet)
