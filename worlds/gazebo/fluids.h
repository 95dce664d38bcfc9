// Water and wind around all models of a <world>: what the systems buoyancy and wind effects of Gazebo make of
// it.
#pragma once

#include <absl/status/status.h>

#include <Eigen/Core>
#include <optional>
#include <set>
#include <string>

#include "lpss/model/world_description.h"
#include "worlds/loader/inertia.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera::gazebo {

// The water of a world.
struct Water {
  double density = 1000;        // kg/m^3
  double air = 0;               // likewise, of what is above it
  std::optional<double> level;  // m, above the origin of the world; none: it is everywhere
  std::set<std::string> only;   // models and links; empty: all
};

class Fluids {
 public:
  // The <wind> of a world, or a plugin of the world that makes something of water or wind. INVALID_ARGUMENT
  // for what is no number.
  static bool is_one(const xml::Element& element);
  // A plugin for which bodies have to know what they displace.
  static bool is_water(const xml::Element& element);
  absl::Status take(const xml::Element& element, Notices& notices);

  // Gives a dynamic body programs for them. `displaced`: of its shapes, where they have a volume; `start`:
  // its centre of mass, m from the origin of the world.
  void surround(const std::optional<Displacement>& displaced, bool feels_wind, const Eigen::Vector3d& start,
                BodyDescription& body, Notices& notices) const;

 private:
  bool is_wet(const std::string& body) const;

  std::optional<Water> water_;
  Eigen::Vector3d air_ = Eigen::Vector3d::Zero();  // m/s
  double drag_ = 0;                                // 1/s
};

}  // namespace tessera::gazebo
