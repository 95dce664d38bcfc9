// The sensors and plugins of a URDF robot, in its <gazebo> elements: libsdformat is not asked to read them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "worlds/gazebo/ros_control.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera::gazebo {

class UrdfExtras {
 public:
  // Takes them out of a <robot>.
  UrdfExtras(xml::Element& robot, Notices& notices);

  // Puts them into the <model> that it has become: what a link has that has become part of another one is
  // there, at its place.
  void restore(xml::Element& model, Notices& notices) const;

 private:
  struct Sensor {
    std::string reference;  // a link or a joint
    const xml::Element* element = nullptr;
  };
  const xml::Element* keep(const xml::Element& element);

  tinyxml2::XMLDocument kept_;
  std::vector<const xml::Element*> plugins_;
  std::vector<Sensor> sensors_;
  CommandedJoints commanded_;  // none without a plugin that commands them
};

}  // namespace tessera::gazebo
