// tessera-ros: a client of a cluster that publishes its time and its bodies for ROS 2.
#include <absl/strings/str_cat.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/arguments/parse.h"
#include "client_sdk/arguments/parsed_option.h"
#include "client_sdk/live/client_program.h"
#include "daemon/parse_command_line.h"
#include "ros/bridge.h"
#include "ros/descriptions.h"
#include "ros/feed.h"
#include "ros/publisher.h"
#include "ros/services.h"

namespace tessera::ros {
namespace {

constexpr double kReachMax = 1e9;  // m

struct Arguments {
  live::ClientOptions client;
  std::uint32_t domain = 0;
  FeedOptions feed;
  std::string world;
  std::vector<std::string> remaps;
  std::vector<std::string> descriptions;
  std::string controllers;
  std::string bridge;
};

void add_options(CLI::App& app, Arguments& arguments) {
  FeedOptions& feed = arguments.feed;
  live::add_client_options(app, arguments.client);
  app.add_option("--domain", arguments.domain, "ROS domain id, 0 to 232")
      ->envname("ROS_DOMAIN_ID")
      ->check(CLI::Range(0u, 232u))
      ->capture_default_str();
  app.add_option("--frame", feed.frame, "Name of the common parent frame")->capture_default_str();
  add_parsed(app, "--sector", feed.sector, parse_sector,
             "I,J,K: the sector whose centre is that frame; by default that of the world's origin");
  CLI::Option* reach = app.add_option("--reach", feed.reach,
                                      "Publish bodies within this distance of that centre along each axis, m")
                           ->check(number_within(0.0, kReachMax))
                           ->capture_default_str();
  app.add_option("--bodies", feed.bodies, "NAME,NAME,...: publish these bodies instead, wherever they are")
      ->delimiter(',')
      ->excludes(reach);
  app.add_option("--root", feed.robots.root,
                 "MODEL: its topics and frames are without its name: /scan, base_link");
  app.add_option("--tf", feed.transforms, "What /tf tells: bodies, odom (from odom to the robot) or none")
      ->transform(CLI::CheckedTransformer(std::map<std::string, Told>{
          {"bodies", Told::kBodies}, {"odom", Told::kWays}, {"none", Told::kNothing}}));
  app.add_option("--remap", arguments.remaps, "/NAME:=/OTHER: another name of a topic or service")
      ->check([](const std::string& text) { return std::string(parse_remap(text).status().message()); });
  app.add_option(
         "--description", arguments.descriptions,
         "FILE: a URDF file that is published as robot_description, below the name of its robot; repeatable")
      ->check(CLI::ExistingFile);
  app.add_option("--controllers", arguments.controllers,
                 "FILE: parameters of ros2_control, whose forward command controllers command joints")
      ->check(CLI::ExistingFile);
  app.add_option(
         "--bridge", arguments.bridge,
         "FILE: a bridge of ros_gz_bridge: only its topics are there, under the names that it gives them")
      ->check(CLI::ExistingFile);
  app.add_option("--world", arguments.world, "FILE: the world that /reset_simulation loads again")
      ->check(CLI::ExistingFile);
  app.add_option("--rate", feed.rate, "Maximum number of publications per second of wall time")
      ->check(number_within(0.1, 1000.0))
      ->capture_default_str();
}

absl::Status serve(const Arguments& arguments, Client& client, const std::function<void()>& wait) {
  Remaps remaps;
  for (const std::string& text : arguments.remaps) remaps.insert(parse_remap(text).value());
  FeedOptions options = arguments.feed;
  if (!arguments.controllers.empty()) {
    absl::StatusOr<std::vector<JointGroup>> groups = read_controllers(arguments.controllers);
    if (!groups.ok()) return groups.status();
    options.robots.controllers = *std::move(groups);
  }
  std::optional<Bridge> bridge;
  if (!arguments.bridge.empty()) {
    absl::StatusOr<std::vector<BridgeEntry>> entries = read_bridge(arguments.bridge);
    if (!entries.ok()) return entries.status();
    bridge.emplace(*std::move(entries));
    options.robots.bridge = &*bridge;
  }
  const absl::StatusOr<std::unique_ptr<Node>> node = Node::open(arguments.domain, std::move(remaps));
  if (!node.ok()) return node.status();
  for (const std::string& file : arguments.descriptions) {
    absl::Status status = publish_description(**node, file, arguments.feed.robots.root);
    if (!status.ok()) return status;
  }
  const absl::StatusOr<Publisher> publisher = Publisher::open(**node, options.robots.bridge);
  if (!publisher.ok()) return publisher.status();
  const Feed feed(client, **node, *publisher, options);
  const auto services =
      Services::open(client, **node, {arguments.feed.frame, arguments.feed.sector, arguments.world});
  if (!services.ok()) return services.status();
  const std::string what = bridge ? absl::StrCat("the topics of ", arguments.bridge)
                                  : "/clock, /tf, /tf_static, sensors and joints";
  std::printf("publishing %s in ROS domain %u\n", what.c_str(), arguments.domain);
  std::fflush(stdout);
  wait();
  return absl::OkStatus();
}

}  // namespace
}  // namespace tessera::ros

int main(int argc, char** argv) {
  using namespace tessera;
  ros::Arguments arguments;
  CLI::App app(
      "Publishes the time, bodies, sensors and joints of a cluster to ROS 2, and takes its commands.",
      "tessera-ros");
  app.footer("Example: tessera-ros --connect 127.0.0.1:7300 --sector 2^62,0,0 --reach 50");
  ros::add_options(app, arguments);
  return live::run_client(
      app, argc, argv, arguments.client,
      [&](Client& client, const std::function<void()>& wait) { return ros::serve(arguments, client, wait); });
}
