#include "worlds/gazebo/systems.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/string_view.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>

#include "worlds/gazebo/added_mass.h"
#include "worlds/gazebo/system_kinds.h"

namespace tessera::gazebo {
namespace {

using xml::Element;

struct Entry {
  absl::string_view name;           // as canonical_name() has it
  void (*take)(System&) = nullptr;  // none: it is left out
  absl::string_view why = "";       // what it would have done; empty: Tessera does it of itself
};
constexpr std::array kEntries = {
    Entry{"ackermann-steering", take_ackermann},
    Entry{"diff-drive", take_diff_drive},
    Entry{"diffdriveplugin", take_measured_drive},
    Entry{"gazebo-ros-diff-drive", take_diff_drive},
    Entry{"gazebo-ros-skid-steer-drive", take_diff_drive},
    Entry{"skidsteerdriveplugin", take_diff_drive},
    Entry{"gazebo-ros-planar-move", take_planar_move},
    Entry{"mecanum-drive", take_mecanum_drive},
    Entry{"planarmoveplugin", take_planar_move},
    Entry{"track-controller", take_track_controller},
    Entry{"tracked-vehicle", take_tracked_vehicle},
    Entry{"trajectory-follower", take_trajectory_follower},
    Entry{"velocity-control", take_velocity_control},
    Entry{"joint-controller", take_joint_velocity},
    Entry{"joint-position-controller", take_joint_position},
    Entry{"joint-trajectory-controller", take_joint_trajectory},
    Entry{"gazebo-mimic-joint-plugin", take_mimic},
    Entry{"mimic-joint-plugin", take_mimic},
    Entry{"mimicjointplugin", take_mimic},
    Entry{"roboticsgroup-gazebo-mimic-joint-plugin", take_mimic},
    Entry{"roboticsgroup-upatras-gazebo-mimic-joint-plugin", take_mimic},
    Entry{"gazebo-ros-p3d", take_pose},
    Entry{"odometry-publisher", take_pose},
    Entry{"gazebo-groundtruth-plugin", take_pose},
    Entry{"gazebo-imu-plugin", take_imu},
    Entry{"gazebo-ros-imu", take_imu},
    Entry{"gazebo-barometer-plugin", take_barometer},
    Entry{"performer-detector", take_performer_detector},
    Entry{"touchplugin", take_touch},
    Entry{"gazebo-magnetometer-plugin", take_magnetometer},
    Entry{"hydrodynamics", take_hydrodynamics},
    Entry{"lift-drag", take_lift_drag},
    Entry{"liftdragplugin", take_lift_drag},
    Entry{"gazebo-motor-model", take_motor},
    Entry{"multicopter-control", take_multicopter},
    Entry{"multicopter-motor-model", take_motor},
    Entry{"multicopter-velocity-control", take_multicopter},
    Entry{"rotors-gazebo-motor-model", take_motor},
    Entry{"thruster", take_propeller},
    Entry{kTriggeredPublisher, take_triggered_publisher},
    Entry{"gazebo-ros-control", take_ros_control},
    Entry{"gazebo-ros2-control", take_ros_control},
    Entry{"gz-ros2-control", take_ros_control},
    Entry{"ign-ros2-control", take_ros_control},
    // What Tessera does of itself: bodies and joints are there for all who ask, sensors measure, clients
    // command.
    Entry{"air-pressure"},
    Entry{"altimeter"},
    Entry{"contact"},
    Entry{"force-torque"},
    Entry{"forcetorque"},
    Entry{"gazebo-ros-factory"},
    Entry{"gazebo-ros-init"},
    Entry{"gazebo-ros-joint-state-publisher"},
    Entry{"gazebo-ros-state"},
    Entry{"imu"},
    Entry{"joint-state-publisher"},
    Entry{"label"},
    Entry{"magnetometer"},
    Entry{"navsat"},
    Entry{"nav-sat"},
    Entry{"physics"},
    Entry{"pose-publisher"},
    Entry{"scene-broadcaster"},
    Entry{"sensors"},
    Entry{"user-commands"},
    // What is known, and not done.
    Entry{"apply-joint-force", nullptr, "it would have pushed a joint"},
    Entry{"camera-video-recorder", nullptr, "nothing is rendered"},
    Entry{"gazebo-ros-camera", nullptr, "cameras are not rendered"},
    Entry{"gazebo-ros-openni-kinect", nullptr, "cameras are not rendered"},
};

// "DiffDrive" as "diff-drive".
std::string in_words(absl::string_view camel) {
  std::string words;
  for (const char c : camel) {
    const bool is_upper = c >= 'A' && c <= 'Z';
    if (is_upper && !words.empty()) words += '-';
    words += absl::ascii_tolower(static_cast<unsigned char>(c));
  }
  return words;
}

// What comes after a prefix such as "gz-sim8-".
bool strip_release(absl::string_view prefix, std::string& name) {
  absl::string_view rest = name;
  if (!absl::ConsumePrefix(&rest, prefix)) return false;
  while (!rest.empty() && absl::ascii_isdigit(static_cast<unsigned char>(rest.front())))
    rest.remove_prefix(1);
  if (!absl::ConsumePrefix(&rest, "-")) return false;
  name = std::string(rest);
  return true;
}

const Entry* find_entry(const Element& plugin) {
  const std::string name = canonical_name(plugin);
  const auto found = std::ranges::find(kEntries, absl::string_view(name), &Entry::name);
  return found == kEntries.end() ? nullptr : &*found;
}

}  // namespace

std::string canonical_name(const Element& plugin) {
  const char* const file = plugin.Attribute("filename");
  const char* const name = plugin.Attribute("name");
  if (file == nullptr || *file == '\0') {
    const absl::string_view full = name == nullptr ? "" : name;
    const std::size_t colons = full.rfind("::");
    return colons == absl::string_view::npos ? "" : in_words(full.substr(colons + 2));
  }
  absl::string_view base = file;
  if (const std::size_t slash = base.rfind('/'); slash != absl::string_view::npos)
    base = base.substr(slash + 1);
  absl::ConsumeSuffix(&base, ".so");
  absl::ConsumePrefix(&base, "lib");
  std::string result = absl::AsciiStrToLower(absl::StrReplaceAll(base, {{"_", "-"}}));
  strip_release("gz-sim", result) || strip_release("ignition-gazebo", result);
  return std::string(absl::StripSuffix(result, "-system"));
}

std::string skipped(const Element& plugin) {
  const char* const file = plugin.Attribute("filename");
  const std::string title = file == nullptr ? "<plugin>" : absl::StrCat("<plugin> ", file);
  const Entry* const entry = find_entry(plugin);
  if (entry == nullptr) return absl::StrCat(title, " skipped");
  if (entry->take != nullptr) return absl::StrCat(title, " skipped: it belongs in a <model>");
  return entry->why.empty() ? "" : absl::StrCat(title, " skipped: ", entry->why);
}

void take_systems(const ModelParts& parts, Notices& notices) {
  Element& model = parts.model();
  // Some look at others of their model, so that all are there until the end.
  for (Element* plugin = model.FirstChildElement("plugin"); plugin != nullptr;
       plugin = plugin->NextSiblingElement("plugin")) {
    const Entry* const entry = find_entry(*plugin);
    if (entry != nullptr && entry->take != nullptr) {
      System system(*plugin, parts, notices);
      entry->take(system);
      system.finish();
    } else if (const std::string text = skipped(*plugin); !text.empty()) {
      notices.count(text);
    }
  }
  while (Element* const plugin = model.FirstChildElement("plugin")) model.DeleteChild(plugin);
  take_added_masses(parts, notices);
}

}  // namespace tessera::gazebo
