#include "worlds/gazebo/trigger.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

namespace tessera::gazebo {

absl::Status add_trigger(xml::Element& link, const char* name, const Pose& pose,
                         const Eigen::Vector3d& sides) {
  if (!(sides.minCoeff() > 0) || !(sides.norm() <= kTriggerAcrossMax)) {
    return absl::InvalidArgumentError(absl::StrCat("its box, ", sides.x(), " m x ", sides.y(), " m x ",
                                                   sides.z(), " m, must have sides above 0 and be at most ",
                                                   kTriggerAcrossMax, " m across"));
  }
  xml::Element& zone = *link.InsertNewChildElement("collision");
  zone.SetAttribute("name", name);
  const Eigen::Vector3d& at = pose.position;
  const Eigen::Vector3d angles = xml::angles_of(pose.orientation);
  zone.InsertNewChildElement("pose")->SetText(absl::StrFormat("%.17g %.17g %.17g %.17g %.17g %.17g", at.x(),
                                                              at.y(), at.z(), angles.x(), angles.y(),
                                                              angles.z())
                                                  .c_str());
  xml::Element& box = *zone.InsertNewChildElement("geometry")->InsertNewChildElement("box");
  box.InsertNewChildElement("size")->SetText(
      absl::StrFormat("%.17g %.17g %.17g", sides.x(), sides.y(), sides.z()).c_str());
  zone.InsertNewChildElement("tessera:trigger");
  return absl::OkStatus();
}

}  // namespace tessera::gazebo
