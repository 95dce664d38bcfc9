// What programs that measure publish, as messages of ROS 2.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client_sdk/live/sensor_programs.h"
#include "ros/node.h"
#include "ros/transforms.h"
#include "tessera/batch.h"

namespace tessera::ros {

using live::is_camera;
using live::parameter_of;

struct SensorKind;

// A program that measures, and a topic of what it measures.
struct Sensor {
  FoundProgram program;  // its parameters are those that it was found with
  const SensorKind* kind = nullptr;
  std::string topic;       // "/robot/scan"
  std::string frame;       // in which it measures; of odometry, that in which the way is
  std::string body_frame;  // of its body
  dds_entity_t writer = 0;
  std::vector<double> values;  // the latest; empty: none yet, or it has none
};

// How the programs of a kind are published on a topic.
struct SensorKind {
  absl::string_view program;  // its kind
  absl::string_view name;     // of topics, where the program has no name
  absl::string_view part;     // of several topics of a program: what comes after the name
  const dds_topic_descriptor_t* type = nullptr;
  absl::Status (*publish)(const Sensor&, const Time&) = nullptr;
};
// All topics of a program; none of one that does not measure.
std::span<const SensorKind> sensor_kinds(const FoundProgram& program);

// How the topics of a program with this name end in Gazebo; with a '/' before it, a whole topic.
std::vector<std::string> names_in_gazebo(const SensorKind& kind, const std::string& name);

// Whether there is something to publish. A camera without images has no measurements to wait for.
bool has_measured(const Sensor& sensor);

// One of the latest values by its name; 0 where the program has none of that name.
double value_of(const Sensor& sensor, absl::string_view name);

// The frame of a sensor in its body, of which its measurements have the axes; nothing for one that measures
// in the frame of its body. Of one that has an image, the axes are those of the image: x to the right, y
// downwards, z to where it looks.
std::optional<Pose> frame_in_body(const FoundProgram& program);
bool has_image(const FoundProgram& program);

// Whether a sensor with a rate measures in one of the ticks after `before`, up to `tick`.
bool measures_since(const Sensor& sensor, Tick before, Tick tick, double time_step);

}  // namespace tessera::ros
