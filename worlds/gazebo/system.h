// A plugin of a model while it becomes a program: what it says, what it names in its model, and what comes of
// it.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <Eigen/Core>
#include <algorithm>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "worlds/gazebo/model_parts.h"
#include "worlds/gazebo/numbers.h"
#include "worlds/gazebo/program_writer.h"
#include "worlds/loader/notices.h"

namespace tessera::gazebo {

// Bounds of accelerations (m/s^2, rad/s^2) and of efforts, as programs have them: 0 or less is none.
inline constexpr double kUnlimited = 1e4;
inline constexpr double kUnbounded = 1e12;
inline double accelerates(double given) { return given > 0 ? std::min(given, kUnlimited) : kUnlimited; }
inline double bound(double given) { return given > 0 ? std::min(given, kUnbounded) : kUnbounded; }

class System {
 public:
  System(const xml::Element& plugin, const ModelParts& parts, Notices& notices)
      : plugin_(plugin), parts_(parts), notices_(notices) {}

  const xml::Element& plugin() const { return plugin_; }
  const ModelParts& parts() const { return parts_; }
  std::string name() const { return xml::attribute_of(&plugin_, "name"); }
  std::string title() const;

  double number(std::initializer_list<const char*> spellings, double otherwise) {
    return numbers_.read(plugin_, spellings, otherwise);
  }
  bool flag(const char* name, bool otherwise) { return numbers_.read_bool(plugin_, name, otherwise); }
  Eigen::Vector3d vector(const char* name, const Eigen::Vector3d& otherwise);
  std::string text(std::initializer_list<const char*> spellings) const {
    return text_of_any(plugin_, spellings);
  }
  // The texts of all children of these names.
  std::vector<std::string> texts(std::initializer_list<const char*> spellings) const;

  std::string name_of(const xml::Element& part) const { return parts_.name_of(part); }

  // Parts that are named. Where there is none, these fail, and return null, or nothing.
  xml::Element* joint(const std::string& name);
  std::optional<ModelParts::Place> place(const std::string& name);
  // The link that moves by a joint ("child"), or the one that it moves in ("parent").
  xml::Element* side(const xml::Element& joint, const char* side);
  // The link that wheels are mounted to, or else the first one.
  xml::Element* chassis(const xml::Element& joint);
  xml::Element* first_link();

  void write(const ProgramWriter& program, xml::Element& link);
  void note(absl::string_view what) { notices_.count(absl::StrCat(title(), ": ", what)); }
  void fail(absl::string_view why) { status_.Update(absl::InvalidArgumentError(why)); }

  // Says what has come of it.
  void finish();

 private:
  const xml::Element& plugin_;
  const ModelParts& parts_;
  Notices& notices_;
  Numbers numbers_;
  absl::Status status_;
  std::vector<std::string> programs_;
};

}  // namespace tessera::gazebo
