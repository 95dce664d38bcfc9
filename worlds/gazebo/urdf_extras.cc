#include "worlds/gazebo/urdf_extras.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <optional>

#include "worlds/gazebo/model_parts.h"

namespace tessera::gazebo {
namespace {

using xml::Element;

// A sensor that was given in a frame which is at `frame` in its link. A pose that cannot be read is told
// later.
void move(Element& sensor, const Pose& frame) {
  if (frame.is_identity()) return;
  Element* given = sensor.FirstChildElement("pose");
  if (given == nullptr) given = sensor.InsertNewChildElement("pose");
  const absl::StatusOr<xml::RelativePose> pose =
      given->NoChildren() ? xml::RelativePose{} : xml::pose_of(*given);
  if (pose.ok() && pose->relative_to.empty()) xml::set_pose(*given, frame * pose->pose);
}

}  // namespace

const Element* UrdfExtras::keep(const Element& element) {
  return kept_.InsertEndChild(element.DeepClone(&kept_))->ToElement();
}

UrdfExtras::UrdfExtras(Element& robot, Notices& notices) {
  for (Element* gazebo = robot.FirstChildElement("gazebo"); gazebo != nullptr;
       gazebo = gazebo->NextSiblingElement("gazebo")) {
    const char* const reference = gazebo->Attribute("reference");
    while (Element* const plugin = gazebo->FirstChildElement("plugin")) {
      plugins_.push_back(keep(*plugin));
      gazebo->DeleteChild(plugin);
    }
    while (Element* const sensor = gazebo->FirstChildElement("sensor")) {
      sensors_.push_back({reference == nullptr ? "" : reference, keep(*sensor)});
      gazebo->DeleteChild(sensor);
    }
  }
  if (std::ranges::any_of(plugins_, [](const Element* plugin) { return is_ros_control(*plugin); }))
    commanded_ = take_commanded_joints(robot, notices);
}

void UrdfExtras::restore(Element& model, Notices& notices) const {
  const ModelParts parts(model);
  for (const Sensor& sensor : sensors_) {
    if (Element* const joint = parts.joint(sensor.reference)) {
      xml::copy_into(*sensor.element, *joint);
    } else if (const std::optional<ModelParts::Place> place = parts.place(sensor.reference)) {
      move(xml::copy_into(*sensor.element, *place->link), place->pose);
    } else {
      notices.count("<sensor> of a link that is not there, skipped");
    }
  }
  for (const Element* plugin : plugins_) xml::copy_into(*plugin, model);
  hold(commanded_, model);
}

}  // namespace tessera::gazebo
