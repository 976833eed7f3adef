// A roscpp program with one role, its first argument; it prints what happens, a line each.
#include <cstdio>
#include <string>

#include <ros/ros.h>
#include <std_msgs/String.h>
#include <std_srvs/SetBool.h>

static void say(const std::string& text) {
  std::printf("%s\n", text.c_str());
  std::fflush(stdout);
}

static void heard(const ros::MessageEvent<std_msgs::String const>& event) {
  say("heard " + event.getMessage()->data);
}

static bool serve(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
  response.success = request.data;
  response.message = "from roscpp";
  return request.data;
}

static int call(bool persistent) {
  ros::NodeHandle node;
  auto client = node.serviceClient<std_srvs::SetBool>("question", persistent);
  client.waitForExistence();
  for (int number = 0; number < 4; ++number) {
    std_srvs::SetBool service;
    service.request.data = number % 2 == 0;
    const bool ok = client.call(service);
    say(std::string(ok ? "answer " : "refused ") + service.response.message);
  }
  return 0;
}

static int follow_parameter() {
  ros::NodeHandle node;
  int value = -1;
  for (ros::Rate rate(50); ros::ok(); rate.sleep()) {
    int now = -1;
    if (node.getParamCached("/followed", now) && now != value) {
      value = now;
      say("parameter " + std::to_string(value));
    }
    ros::spinOnce();
  }
  return 0;
}

int main(int argc, char** argv) {
  ros::init(argc, argv, "partner");
  ros::NodeHandle node;
  const std::string role = argc > 1 ? argv[1] : "";
  if (role == "talker" || role == "latched") {
    auto publisher = node.advertise<std_msgs::String>("chatter", 10, role == "latched");
    say("ready");
    std_msgs::String message;
    message.data = role;
    if (role == "latched") {
      publisher.publish(message);
      ros::spin();
      return 0;
    }
    int number = 0;
    for (ros::Rate rate(20); ros::ok(); rate.sleep()) {
      message.data = role + " " + std::to_string(number++);
      publisher.publish(message);
      ros::spinOnce();
    }
    return 0;
  }
  if (role == "listener") {
    auto subscriber = node.subscribe("chatter", 10, heard, ros::TransportHints().tcpNoDelay());
    say("ready");
    ros::spin();
    return 0;
  }
  if (role == "echo") {
    auto publisher = node.advertise<std_msgs::String>("echoed", 10);
    auto subscriber = node.subscribe<std_msgs::String>(
        "chatter", 10, [&](const std_msgs::String::ConstPtr& message) { publisher.publish(message); });
    say("ready");
    ros::spin();
    return 0;
  }
  if (role == "server") {
    auto server = node.advertiseService("question", serve);
    say("ready");
    ros::spin();
    return 0;
  }
  if (role == "client" || role == "persistent") return call(role == "persistent");
  if (role == "parameter") return follow_parameter();
  say("unknown role " + role);
  return 2;
}
