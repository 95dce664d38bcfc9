// Programs of links, written for what a file describes in Gazebo's words.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <string>
#include <utility>
#include <vector>

#include "lpss/base/pose.h"
#include "worlds/loader/xml.h"

namespace tessera::gazebo {

// How such an element is named, so that it is not taken for one of the file: where its body or joint turns
// out not to be there, or not to move, it is left out.
inline constexpr char kSystemProgram[] = "tessera:system_program";

class ProgramWriter {
 public:
  // Of a built-in kind; `name` may be empty; one that a program cannot have is left out.
  ProgramWriter(absl::string_view kind, absl::string_view name);

  ProgramWriter& set(absl::string_view number, double value) {
    numbers_.emplace_back(number, value);
    return *this;
  }
  // A number that is a body or joint.
  ProgramWriter& set(absl::string_view number, const std::string& named) {
    ids_.emplace_back(number, named);
    return *this;
  }
  // A pose in the frame of the link: x, y, z; and roll, pitch, yaw.
  ProgramWriter& set_place(const Pose& pose);
  ProgramWriter& set_turn(const Pose& pose);

  const std::string& kind() const { return kind_; }
  // Adds it to a <link>. INVALID_ARGUMENT, with the number and its bound.
  absl::Status write(xml::Element& link) const;

 private:
  std::string kind_;
  std::string name_;
  std::vector<std::pair<std::string, double>> numbers_;
  std::vector<std::pair<std::string, std::string>> ids_;
};

// Gives a <joint> a drive of its first axis: its `mode`, and the target (rad, m, rad/s or m/s). One that the
// file gives it stays.
void write_drive(xml::Element& joint, const char* mode, double target);

}  // namespace tessera::gazebo
