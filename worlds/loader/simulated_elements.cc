#include "worlds/loader/simulated_elements.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>

namespace tessera {
namespace {

// What is simulated of SDF: elements with a value, each after the element that it is in. All others are not.
constexpr std::array<absl::string_view, 62> kSimulated = {"model/static",
                                                          "model/self_collide",
                                                          "link/enable_wind",
                                                          "link/gravity",
                                                          "model/enable_wind",
                                                          "link/self_collide",
                                                          "link/kinematic",
                                                          "velocity_decay/linear",
                                                          "velocity_decay/angular",
                                                          "inertial/mass",
                                                          "inertia/ixx",
                                                          "inertia/iyy",
                                                          "inertia/izz",
                                                          "inertia/ixy",
                                                          "inertia/ixz",
                                                          "inertia/iyz",
                                                          "box/size",
                                                          "sphere/radius",
                                                          "capsule/radius",
                                                          "capsule/length",
                                                          "cylinder/radius",
                                                          "cylinder/length",
                                                          "ellipsoid/radii",
                                                          "plane/normal",
                                                          "plane/size",
                                                          "mesh/uri",
                                                          "mesh/scale",
                                                          "submesh/name",
                                                          "submesh/center",
                                                          "bounce/restitution_coefficient",
                                                          "ode/mu",
                                                          "ode/mu2",
                                                          "ode/fdir1",
                                                          "bullet/friction",
                                                          "bullet/friction2",
                                                          "bullet/fdir1",
                                                          "bullet/rolling_friction",
                                                          "torsional/coefficient",
                                                          "torsional/use_patch_radius",
                                                          "torsional/patch_radius",
                                                          "contact/collide_bitmask",
                                                          "contact/category_bitmask",
                                                          "joint/parent",
                                                          "joint/child",
                                                          "joint/thread_pitch",
                                                          "joint/gearbox_ratio",
                                                          "joint/gearbox_reference_body",
                                                          "axis/xyz",
                                                          "axis2/xyz",
                                                          "dynamics/damping",
                                                          "dynamics/friction",
                                                          "dynamics/spring_reference",
                                                          "dynamics/spring_stiffness",
                                                          "limit/lower",
                                                          "limit/upper",
                                                          "limit/effort",
                                                          "limit/velocity",
                                                          "world/gravity",
                                                          "world/physics",
                                                          "physics/gravity",
                                                          "physics/max_step_size"};

constexpr std::array<absl::string_view, 12> kNoPhysics = {
    "visual",      "light",      "sensor",    "plugin",  "gripper",          "audio_source",
    "laser_retro", "audio_sink", "projector", "battery", "particle_emitter", "allow_auto_disable"};

}  // namespace

bool is_no_physics(absl::string_view name) { return std::ranges::find(kNoPhysics, name) != kNoPhysics.end(); }

absl::string_view fate_of(absl::string_view name) {
  return name == "visual" ? "for the web UI alone" : "skipped";
}

bool is_simulated(absl::string_view parent, absl::string_view name) {
  return name == "pose" ||
         std::ranges::find(kSimulated, absl::string_view(absl::StrCat(parent, "/", name))) !=
             kSimulated.end();
}

}  // namespace tessera
