#include "worlds/gazebo/sensors.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>

#include "lpss/base/portable_math.h"
#include "lpss/model/limits.h"
#include "worlds/gazebo/numbers.h"
#include "worlds/gazebo/program_writer.h"
#include "worlds/gazebo/publication.h"
#include "worlds/gazebo/trigger.h"

namespace tessera::gazebo {
namespace {

using xml::Element;

// A <sensor> where it is.
struct Sensor {
  const Element& element;
  std::string type;
  Pose pose;  // in its link; of one in a joint, in the joint
};

// What a kind of sensor says beside numbers, and what is not simulated of it.
class Reading {
 public:
  Reading(const Sensor& sensor, Notices& notices) : sensor_(sensor), notices_(notices) {}

  const Element& element() const { return sensor_.element; }
  double number_of(const Element& parent, const char* child) { return numbers_.read(parent, child, 0); }
  double number_in(const Element* parent, std::initializer_list<const char*> way, double otherwise) {
    return numbers_.read(find(parent, way), otherwise);
  }
  double number(std::initializer_list<const char*> way, double otherwise) {
    return numbers_.read(find(&sensor_.element, way), otherwise);
  }
  // The standard deviation that the <noise> of an element has; old files have it without `type`. What else a
  // noise has is named.
  double deviation(const Element* noisy, bool has_lasting_errors = false) {
    const Element* const noise = find(noisy, {"noise"});
    return noise == nullptr ? 0 : deviation_of(*noise, has_lasting_errors);
  }
  double deviation(std::initializer_list<const char*> way) { return deviation(find(&sensor_.element, way)); }
  // The largest of three axes.
  double deviation_of_axes(const Element* parent, bool has_lasting_errors = false) {
    std::array<double, 3> axes{};
    const std::array<const char*, 3> names = {"x", "y", "z"};
    for (std::size_t n = 0; n < axes.size(); ++n)
      axes[n] = deviation(find(parent, {names[n]}), has_lasting_errors);
    const double most = *std::ranges::max_element(axes);
    if (*std::ranges::min_element(axes) != most) leave_out("axes with noise of their own");
    return most;
  }
  void leave_out(absl::string_view what) { note(absl::StrCat(what, " not simulated")); }
  void note(absl::string_view text) { notices_.count(absl::StrCat("<sensor> ", sensor_.type, ": ", text)); }
  const absl::Status& status() const { return numbers_.status(); }

 private:
  double deviation_of(const Element& noise, bool has_lasting_errors) {
    for (const char* part : {"mean", "bias_mean", "bias_stddev", "dynamic_bias_stddev", "precision"}) {
      if (!has_lasting_errors && numbers_.read(noise, part, 0) != 0)
        leave_out(absl::StrCat("<", part, "> of noise"));
    }
    return std::abs(numbers_.read(noise, "stddev", 0));
  }

  const Sensor& sensor_;
  Notices& notices_;
  Numbers numbers_;
};

// What the <noise> of an element has beside what is drawn anew in each tick. `numbers`: before the names of
// the program's numbers.
void write_lasting_errors(Reading& reading, const Element* noisy, const std::string& numbers,
                          ProgramWriter& program) {
  const Element* const noise = find(noisy, {"noise"});
  if (noise == nullptr) return;
  const auto number = [&](const char* name) { return reading.number_of(*noise, name); };
  const double time = number("dynamic_bias_correlation_time");
  program.set(numbers + "offset", number("mean") + number("bias_mean"))
      .set(numbers + "bias", std::abs(number("bias_stddev")))
      .set(numbers + "precision", std::abs(number("precision")));
  // Gazebo has how fast it wanders.
  if (time > 0) {
    program.set(numbers + "drift", std::abs(number("dynamic_bias_stddev")) * std::sqrt(time / 2))
        .set(numbers + "drift_time", time);
  }
}

void write_imu(const Sensor& sensor, Reading& reading, ProgramWriter& program) {
  program.set_place(sensor.pose).set_turn(sensor.pose);
  const Element* const imu = sensor.element.FirstChildElement("imu");
  if (const Element* const old = find(imu, {"noise"})) {  // before SDF 1.5
    Numbers numbers;
    program.set("turn_noise", std::abs(numbers.read(find(old, {"rate", "stddev"}), 0)))
        .set("noise", std::abs(numbers.read(find(old, {"accel", "stddev"}), 0)));
    return;
  }
  const Element* const turn = find(imu, {"angular_velocity"});
  const Element* const acceleration = find(imu, {"linear_acceleration"});
  program.set("turn_noise", reading.deviation_of_axes(turn, /*has_lasting_errors=*/true))
      .set("noise", reading.deviation_of_axes(acceleration, /*has_lasting_errors=*/true));
  write_lasting_errors(reading, find(turn, {"x"}), "turn_", program);
  write_lasting_errors(reading, find(acceleration, {"x"}), "", program);
}

// The whole <noise> of an element at the end of a way of children.
void write_noise(Reading& reading, std::initializer_list<const char*> way, const std::string& numbers,
                 ProgramWriter& program) {
  const Element* const noisy = find(&reading.element(), way);
  program.set(numbers + "noise", reading.deviation(noisy, /*has_lasting_errors=*/true));
  write_lasting_errors(reading, noisy, numbers, program);
}

struct Fan {
  double rays = 1;
  double middle = 0;  // rad
  double angle = 0;
};

Fan fan_of(Reading& reading, const Element* scan) {
  Numbers numbers;
  const auto number = [&](const char* name, double otherwise) {
    return numbers.read(find(scan, {name}), otherwise);
  };
  const double rays = std::round(number("samples", 1) * number("resolution", 1));
  const double first = number("min_angle", 0);
  const double last = number("max_angle", 0);
  if (!numbers.status().ok()) reading.leave_out("a number that is none");
  if (rays <= 1) return {1, first, 0};
  return {rays, (first + last) / 2, std::abs(last - first)};
}

void write_lidar(const Sensor& sensor, Reading& reading, ProgramWriter& program) {
  constexpr double kRaysMax = 1024;
  constexpr double kRowsOfMany = 64;
  program.set_place(sensor.pose).set_turn(sensor.pose);
  const char* const tag = sensor.element.FirstChildElement("lidar") != nullptr ? "lidar" : "ray";
  const Element* const lidar = sensor.element.FirstChildElement(tag);
  Fan row = fan_of(reading, find(lidar, {"scan", "horizontal"}));
  Fan column = fan_of(reading, find(lidar, {"scan", "vertical"}));
  if (row.rays * column.rays > kRaysMax) {
    const double all = row.rays * column.rays;
    column.rays = std::min(column.rays, kRowsOfMany);
    row.rays = std::min(row.rays, std::floor(kRaysMax / column.rays));
    reading.note(absl::StrCat(all, " rays are thinned out to ", row.rays * column.rays));
  }
  program.set("rays", row.rays)
      .set("heading", row.middle)
      .set("angle", row.angle)
      .set("rows", column.rays)
      .set("elevation", column.middle)
      .set("row_angle", column.angle)
      .set("least", reading.number({tag, "range", "min"}, 0))
      .set("most", std::min(reading.number({tag, "range", "max"}, 30), kProgramCastMax))
      .set("noise", reading.deviation(lidar))
      .set("rate", reading.number({"update_rate"}, 0));
}

// Its cone as rays in a square about it.
void write_sonar(const Sensor& sensor, Reading& reading, ProgramWriter& program) {
  constexpr double kRaysOfASide = 9;
  const double most = reading.number({"sonar", "max"}, 1);
  const double radius = reading.number({"sonar", "radius"}, 0.5);
  const double angle = most > 0 ? 2 * portable::atan2(radius, most) : 0;
  program.set_place(sensor.pose)
      .set_turn(sensor.pose)
      .set("rays", kRaysOfASide)
      .set("angle", angle)
      .set("rows", kRaysOfASide)
      .set("row_angle", angle)
      .set("least", reading.number({"sonar", "min"}, 0))
      .set("most", std::min(most, kProgramCastMax))
      .set("noise", reading.deviation({"sonar"}))
      .set("rate", reading.number({"update_rate"}, 0));
}

// Of an image, as many pixels as it may have rays, in its proportions.
void write_depth_camera(const Sensor& sensor, Reading& reading, ProgramWriter& program) {
  constexpr double kPixelsMax = 1024;
  const double width = std::max(std::round(reading.number({"camera", "image", "width"}, 320)), 1.0);
  const double height = std::max(std::round(reading.number({"camera", "image", "height"}, 240)), 1.0);
  const double field = std::clamp(reading.number({"camera", "horizontal_fov"}, 1.047), 0.01, 3.0);
  const double part = std::min(std::sqrt(kPixelsMax / (width * height)), 1.0);
  const double columns = std::clamp(std::floor(width * part), 1.0, kPixelsMax);
  const double rows = std::clamp(std::floor(height * part), 1.0, std::floor(kPixelsMax / columns));
  if (part < 1)
    reading.note(absl::StrCat(width, " x ", height, " pixels are thinned out to ", columns, " x ", rows));
  if (absl::StartsWith(sensor.type, "rgbd")) reading.leave_out("colours");
  const double half = portable::sincos(field / 2).sin / portable::sincos(field / 2).cos;
  program.set_place(sensor.pose)
      .set_turn(sensor.pose)
      .set("plane", 1)
      .set("rays", columns)
      .set("rows", rows)
      .set("angle", field)
      .set("row_angle", std::min(2 * portable::atan2(half * height / width, 1), 3.0))
      .set("least", reading.number({"camera", "clip", "near"}, 0.1))
      .set("most", std::min(reading.number({"camera", "clip", "far"}, 10), kProgramCastMax))
      .set("noise", reading.deviation({"camera"}))
      .set("rate", reading.number({"update_rate"}, 0));
}

// Its images are not rendered: only its frame and its camera info are published.
void write_camera(const Sensor& sensor, Reading& reading, ProgramWriter& program) {
  const Element* const camera = sensor.element.FirstChildElement("camera");
  if (camera != nullptr && camera->NextSiblingElement("camera") != nullptr)
    reading.leave_out("cameras after its first one");
  reading.leave_out("images");
  const auto number = [&](std::initializer_list<const char*> way, double otherwise) {
    return reading.number_in(camera, way, otherwise);
  };
  program.set_place(sensor.pose)
      .set_turn(sensor.pose)
      .set("width", number({"image", "width"}, 320))
      .set("height", number({"image", "height"}, 240))
      .set("angle", number({"horizontal_fov"}, 1.047))
      .set("rate", reading.number({"update_rate"}, 0));
  if (const Element* const lens = find(camera, {"lens", "intrinsics"})) {
    program.set("focal_x", reading.number_in(lens, {"fx"}, 0))
        .set("focal_y", reading.number_in(lens, {"fy"}, 0))
        .set("centre_x", reading.number_in(lens, {"cx"}, -1))
        .set("centre_y", reading.number_in(lens, {"cy"}, -1));
  }
  for (const char* part : {"k1", "k2", "p1", "p2", "k3"}) program.set(part, number({"distortion", part}, 0));
}

void write_logical_camera(const Sensor& sensor, Reading& reading, ProgramWriter& program) {
  const auto number = [&](const char* name, double otherwise) {
    return reading.number({"logical_camera", name}, otherwise);
  };
  program.set_place(sensor.pose)
      .set_turn(sensor.pose)
      .set("near", number("near", 0))
      .set("far", number("far", 1))
      .set("angle", number("horizontal_fov", 1))
      .set("aspect", number("aspect_ratio", 1));
}

void write_contact(const Sensor&, Reading&, ProgramWriter&) {}

void write_altimeter(const Sensor&, Reading& reading, ProgramWriter& program) {
  write_noise(reading, {"altimeter", "vertical_position"}, "", program);
  write_noise(reading, {"altimeter", "vertical_velocity"}, "climb_", program);
}

void write_satellite(const Sensor& sensor, Reading& reading, ProgramWriter& program) {
  const char* const tag = sensor.element.FirstChildElement("navsat") != nullptr ? "navsat" : "gps";
  write_noise(reading, {tag, "position_sensing", "horizontal"}, "", program);
  write_noise(reading, {tag, "position_sensing", "vertical"}, "height_", program);
  write_noise(reading, {tag, "velocity_sensing", "horizontal"}, "velocity_", program);
}

void write_magnetometer(const Sensor& sensor, Reading& reading, ProgramWriter& program) {
  const Element* const axes = sensor.element.FirstChildElement("magnetometer");
  program.set_turn(sensor.pose).set("noise", reading.deviation_of_axes(axes, /*has_lasting_errors=*/true));
  write_lasting_errors(reading, find(axes, {"x"}), "", program);
}

void write_barometer(const Sensor&, Reading& reading, ProgramWriter& program) {
  program.set("height", reading.number({"air_pressure", "reference_altitude"}, 0));
  write_noise(reading, {"air_pressure", "pressure"}, "", program);
}

struct Kind {
  absl::string_view type;
  absl::string_view program;
  void (*write)(const Sensor&, Reading&, ProgramWriter&) = nullptr;
};
constexpr std::array kKinds = {
    Kind{"air_pressure", "barometer", write_barometer},
    Kind{"altimeter", "altimeter", write_altimeter},
    Kind{"boundingbox", "camera", write_camera},
    Kind{"boundingbox_camera", "camera", write_camera},
    Kind{"camera", "camera", write_camera},
    Kind{"contact", "touch", write_contact},
    Kind{"depth", "ranger", write_depth_camera},
    Kind{"depth_camera", "ranger", write_depth_camera},
    Kind{"gps", "satellite", write_satellite},
    Kind{"gpu_lidar", "ranger", write_lidar},
    Kind{"gpu_ray", "ranger", write_lidar},
    Kind{"imu", "imu", write_imu},
    Kind{"lidar", "ranger", write_lidar},
    Kind{"logical_camera", "logical_camera", write_logical_camera},
    Kind{"magnetometer", "magnetometer", write_magnetometer},
    Kind{"multicamera", "camera", write_camera},
    Kind{"navsat", "satellite", write_satellite},
    Kind{"ray", "ranger", write_lidar},
    Kind{"rgbd", "ranger", write_depth_camera},
    Kind{"rgbd_camera", "ranger", write_depth_camera},
    Kind{"segmentation", "camera", write_camera},
    Kind{"segmentation_camera", "camera", write_camera},
    Kind{"sonar", "ranger", write_sonar},
    Kind{"thermal", "camera", write_camera},
    Kind{"thermal_camera", "camera", write_camera},
    Kind{"wide_angle_camera", "camera", write_camera},
    Kind{"wideanglecamera", "camera", write_camera},
};

// The pose of a sensor in `link`; nothing where it is relative to something that is not fixed to it.
std::optional<Pose> pose_of(const Element& sensor, const Element& link, const ModelParts& parts) {
  const Element* const given = sensor.FirstChildElement("pose");
  if (given == nullptr) return Pose{};
  const absl::StatusOr<xml::RelativePose> pose = xml::pose_of(*given);
  if (!pose.ok()) return std::nullopt;
  if (pose->relative_to.empty()) return pose->pose;
  const std::optional<ModelParts::Place> place = parts.place(pose->relative_to);
  if (!place || place->link != &link) return std::nullopt;
  return place->pose * pose->pose;
}

// The last word of a topic: "/robot/front/scan" is "scan". A topic of images is one of several topics of its
// camera, whose name is the word before: "/robot/left/image_raw" is "left".
std::string word_of(const std::string& topic, bool is_of_images) {
  const std::size_t slash = topic.rfind('/');
  if (is_of_images && slash != std::string::npos && slash > 0) return word_of(topic.substr(0, slash), false);
  return topic.substr(slash + 1);
}

// That of its topic, as the file or a plugin of ROS has it, if no other program of the link has it; or else
// its own name.
std::string name_for(const Element& sensor, const Element& link, bool is_camera = false) {
  const auto word_in = [&](const std::string& topic) { return word_of(topic, is_camera); };
  std::string word = word_in(xml::child_text(sensor, "topic"));
  for (const Element* plugin = sensor.FirstChildElement("plugin"); plugin != nullptr && word.empty();
       plugin = plugin->NextSiblingElement("plugin")) {
    word = is_camera ? text_of_any(*plugin, {"cameraName", "camera_name"})
                     : xml::child_text(*plugin, "topicName");
    word = word_in(word);
    const Element* const ros = plugin->FirstChildElement("ros");
    for (const Element* remap = ros == nullptr ? nullptr : ros->FirstChildElement("remapping");
         remap != nullptr && word.empty(); remap = remap->NextSiblingElement("remapping")) {
      const std::string text = xml::text_of(*remap);
      if (const std::size_t sign = text.find(":="); sign != std::string::npos)
        word = word_in(text.substr(sign + 2));
    }
  }
  for (const Element* other = link.FirstChildElement(kSystemProgram); other != nullptr;
       other = other->NextSiblingElement(kSystemProgram)) {
    if (xml::attribute_of(other, "name") == word) word.clear();
  }
  return word.empty() ? xml::attribute_of(&sensor, "name") : word;
}

class Taking {
 public:
  Taking(const ModelParts& parts, Notices& notices) : parts_(parts), notices_(notices) {}

  void take_from_link(Element& link) {
    while (Element* const sensor = link.FirstChildElement("sensor")) {
      of_link(*sensor, link);
      link.DeleteChild(sensor);
    }
  }

  void take_from_joint(Element& joint) {
    while (Element* const sensor = joint.FirstChildElement("sensor")) {
      of_joint(*sensor, joint);
      joint.DeleteChild(sensor);
    }
  }

 private:
  void of_link(const Element& element, Element& link) {
    const std::string type = xml::attribute_of(&element, "type");
    const auto kind = std::ranges::find(kKinds, absl::string_view(type), &Kind::type);
    if (kind == kKinds.end()) return leave_out(type, "");
    const std::optional<Pose> pose = pose_of(element, link, parts_);
    if (!pose) return leave_out(type, ", whose pose is malformed or not fixed to its link,");
    const Sensor sensor{element, type, *pose};
    Reading reading(sensor, notices_);
    ProgramWriter program(kind->program, name_for(element, link, kind->program == "camera"));
    kind->write(sensor, reading, program);
    absl::Status status = reading.status();
    if (status.ok() && kind->program == "logical_camera") status = add_view(sensor, link);
    finish(sensor, status, program, link);
  }

  // The box around what a logical camera sees, as a trigger.
  static absl::Status add_view(const Sensor& sensor, Element& link) {
    constexpr double kAngleMax = 3.1;  // rad, as the program has it
    Numbers numbers;
    const auto number = [&](const char* name) {
      return numbers.read(find(&sensor.element, {"logical_camera", name}), 1);
    };
    const double far = number("far");
    const auto [sin, cos] = portable::sincos(std::clamp(number("horizontal_fov"), 0.0, kAngleMax) / 2);
    const double width = 2 * far * sin / cos;
    const Pose middle{{far / 2, 0, 0}, Eigen::Quaterniond::Identity()};
    return add_trigger(link, "logical_camera", sensor.pose * middle,
                       {far, width, width / number("aspect_ratio")});
  }

  void of_joint(const Element& element, const Element& joint) {
    const std::string type = xml::attribute_of(&element, "type");
    if (type != "force_torque") return leave_out(type, " in a joint");
    Element* const child = parts_.side(joint, "child");
    if (child == nullptr) return leave_out(type, ", whose joint has its child in another model,");
    const Sensor sensor{element, type, {}};
    Reading reading(sensor, notices_);
    const Element* const own = element.FirstChildElement("force_torque");
    const std::string frame = own == nullptr ? "" : xml::child_text(*own, "frame");
    const bool is_on_child =
        own != nullptr && xml::child_text(*own, "measure_direction") == "parent_to_child";
    ProgramWriter program("load", name_for(element, *child));
    program.set("joint", xml::attribute_of(&joint, "name"))
        .set("frame", 1)
        .set("direction", is_on_child ? 1 : -1)
        .set("noise", reading.deviation_of_axes(find(own, {"force"})))
        .set("torque_noise", reading.deviation_of_axes(find(own, {"torque"})));
    if (frame == "parent") reading.leave_out("the frame of the parent (that of the child counts)");
    if (frame == "sensor") program.set_turn(turn_in_child(element, joint, *child));
    finish(sensor, reading.status(), program, *child);
  }

  // Of a sensor in a joint: as it is turned in the child.
  Pose turn_in_child(const Element& sensor, const Element& joint, const Element& child) const {
    Pose pose = pose_of(joint, child, parts_).value_or(Pose{});
    if (const Element* const own = sensor.FirstChildElement("pose")) {
      if (const absl::StatusOr<xml::RelativePose> given = xml::pose_of(*own); given.ok())
        pose = pose * given->pose;
    }
    return pose;
  }

  void leave_out(const std::string& type, absl::string_view why) {
    notices_.count(absl::StrCat("<sensor>", type.empty() ? "" : " ", type, why, " skipped"));
  }

  void finish(const Sensor& sensor, absl::Status status, const ProgramWriter& program, Element& link) {
    if (status.ok()) status = program.write(link);
    if (status.ok()) {
      note_topics(sensor.element, "*", *link.LastChildElement(kSystemProgram));
      notices_.count(absl::StrCat("<sensor> ", sensor.type, " is the program ", program.kind()));
    } else {
      notices_.count_repair(absl::StrCat("<sensor> ", sensor.type, ", left out: ", status.message()),
                            xml::place_of(sensor.element));
    }
  }

  const ModelParts& parts_;
  Notices& notices_;
};

}  // namespace

void take_sensors(const ModelParts& parts, Notices& notices) {
  Taking taking(parts, notices);
  for (Element* child = parts.model().FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    if (xml::is(*child, "link")) taking.take_from_link(*child);
    if (xml::is(*child, "joint")) taking.take_from_joint(*child);
  }
}

}  // namespace tessera::gazebo
