// What lets axes of joints follow others: SDF's and URDF's <mimic>, and gearboxes.
#pragma once

#include <absl/container/flat_hash_set.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "lpss/model/joint.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

struct ModelTemplate;

// Where a <mimic> is kept, which libsdformat does not know, in a <joint> that has been prepared for it.
inline constexpr absl::string_view kKeptMimic = "tessera:mimic";

// A <mimic> before its leader is known.
struct MimicByName {
  std::size_t axis = 0;  // of the follower
  std::string leader;    // as the file has it; later with the names of the models around it
  AxisMimic mimic;       // without a leader
};

// Moves the <mimic> of each axis of a <joint> to elements that survive parsing. INVALID_ARGUMENT, naming the
// place, if one is invalid.
absl::Status keep_mimics(xml::Element& joint);

// The text of such an element.
std::optional<MimicByName> mimic_in(const std::string& text);

// A joint of SDF's type gearbox: with the angles theta_1 from the reference link to the parent, about the
// first axis, and theta_2 from it to the child, about the second: theta_2 = -ratio * theta_1.
struct Gearbox {
  std::string name;
  std::optional<std::size_t> parent;  // places in the links of the template; none: the world
  std::optional<std::size_t> child;
  std::optional<std::size_t> reference;
  double ratio = 1;
  Eigen::Vector3d parent_axis = Eigen::Vector3d::UnitZ();  // in the model's frame
  Eigen::Vector3d child_axis = Eigen::Vector3d::UnitZ();
};

// Lets the joints of a model follow their leaders, and those that hold the links of gearboxes each other.
// `names` are those of all joints of the file, also of those that are left out: what follows one of these
// moves freely, which `model.notices` says. INVALID_ARGUMENT for other names.
absl::Status connect_followers(const absl::flat_hash_set<std::string>& names,
                               const std::vector<Gearbox>& gearboxes, ModelTemplate& model);

}  // namespace tessera
