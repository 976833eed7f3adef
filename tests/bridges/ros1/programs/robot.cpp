// A roscpp program with one role, its first argument, for what is built of topics and services:
// goals, settings, transforms and simulated time. It prints what happens, a line each.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <actionlib/TestAction.h>
#include <actionlib/client/simple_action_client.h>
#include <actionlib/server/simple_action_server.h>
#include <dynamic_reconfigure/TestConfig.h>
#include <dynamic_reconfigure/server.h>
#include <ros/ros.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>

static void say(const std::string& text) {
  std::printf("%s\n", text.c_str());
  std::fflush(stdout);
}

using Server = actionlib::SimpleActionServer<actionlib::TestAction>;
using Client = actionlib::SimpleActionClient<actionlib::TestAction>;

// A negative goal is aborted; another one counts to its number, 50 times a second.
static void execute(Server* server, const actionlib::TestGoalConstPtr& goal) {
  actionlib::TestResult result;
  result.result = 0;
  say("goal " + std::to_string(goal->goal));
  if (goal->goal < 0) {
    result.result = goal->goal;
    server->setAborted(result, "negative");
    return;
  }
  for (ros::Rate rate(50); ros::ok() && result.result < goal->goal; rate.sleep()) {
    if (server->isPreemptRequested()) {
      say("preempted");
      server->setPreempted(result, server->isNewGoalAvailable() ? "by another" : "by cancel");
      return;
    }
    actionlib::TestFeedback feedback;
    feedback.feedback = result.result++;
    server->publishFeedback(feedback);
  }
  if (ros::ok()) server->setSucceeded(result, "counted");
}

static int serve_goals() {
  Server* server = nullptr;
  Server made("count", [&](const actionlib::TestGoalConstPtr& goal) { execute(server, goal); }, false);
  server = &made;
  made.start();
  say("ready");
  ros::spin();
  return 0;
}

// Arguments: the goal, and "cancel" to cancel it at its first feedback.
static int send_goal(int goal, bool cancel) {
  Client client("count", true);
  client.waitForServer();
  actionlib::TestGoal message;
  message.goal = goal;
  bool canceled = false;
  client.sendGoal(
      message, Client::SimpleDoneCallback(), [] { say("active"); },
      [&](const actionlib::TestFeedbackConstPtr&) {
        if (!canceled) say("feedback");
        if (cancel && !canceled) client.cancelGoal();
        canceled = true;
      });
  while (ros::ok() && !client.waitForResult(ros::Duration(0.05))) {
    if (!client.isServerConnected()) {
      say("server lost");
      return 3;
    }
  }
  if (!ros::ok()) return 4;
  const auto state = client.getState();
  say(state.toString() + " " + std::to_string(client.getResult()->result) + " " + state.getText());
  return 0;
}

static int be_configured() {
  dynamic_reconfigure::Server<dynamic_reconfigure_test::TestConfig> server;
  server.setCallback([](dynamic_reconfigure_test::TestConfig& config, uint32_t) {
    if (config.int_ == 7) config.str_ = "corrected";
    say("int " + std::to_string(config.int_) + " str " + config.str_);
  });
  ros::spin();
  return 0;
}

static geometry_msgs::TransformStamped transform(const std::string& parent, const std::string& child) {
  geometry_msgs::TransformStamped made;
  made.header.stamp = ros::Time::now();
  made.header.frame_id = parent;
  made.child_frame_id = child;
  made.transform.translation.x = 1;
  made.transform.rotation.w = 1;
  return made;
}

static int broadcast(const std::string& parent, const std::string& child, bool fixed) {
  tf2_ros::StaticTransformBroadcaster fixed_one;
  tf2_ros::TransformBroadcaster moving;
  if (fixed) fixed_one.sendTransform(transform(parent, child));
  say("ready");
  for (ros::Rate rate(20); ros::ok(); rate.sleep()) {
    if (!fixed) moving.sendTransform(transform(parent, child));
    ros::spinOnce();
  }
  return 0;
}

// Prints the distance of two frames once all transforms between them have arrived.
static int look_up(const std::string& parent, const std::string& child) {
  tf2_ros::Buffer buffer;
  tf2_ros::TransformListener listener(buffer);
  say("ready");
  while (ros::ok() && !buffer.canTransform(parent, child, ros::Time(0))) ros::WallDuration(0.02).sleep();
  if (!ros::ok()) return 0;
  const auto found = buffer.lookupTransform(parent, child, ros::Time(0));
  say("distance " + std::to_string(std::lround(found.transform.translation.x)));
  return 0;
}

static int watch_clock() {
  ros::NodeHandle node;
  ros::Timer timer = node.createTimer(ros::Duration(10), [](const ros::TimerEvent& event) {
    say("timer " + std::to_string(event.current_real.sec / 10));
  });
  say(std::string("simulated ") + (ros::Time::isSimTime() ? "yes" : "no"));
  ros::spin();
  return 0;
}

int main(int argc, char** argv) {
  const std::string role = argc > 1 ? argv[1] : "";
  ros::init(argc, argv, role, ros::init_options::AnonymousName);
  ros::NodeHandle node;
  const std::string first = argc > 2 ? argv[2] : "", second = argc > 3 ? argv[3] : "";
  if (role == "goals") return serve_goals();
  if (role == "goal") return send_goal(std::atoi(first.c_str()), second == "cancel");
  if (role == "configured") return be_configured();
  if (role == "moving" || role == "fixed") return broadcast(first, second, role == "fixed");
  if (role == "lookup") return look_up(first, second);
  if (role == "clock") return watch_clock();
  say("unknown role " + role);
  return 2;
}
