#include "worlds/gazebo/program_writer.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_replace.h>

#include "lpss/base/invariant.h"
#include "lpss/base/utf8.h"
#include "lpss/model/limits.h"
#include "lpss/programs/registry.h"

namespace tessera::gazebo {

ProgramWriter::ProgramWriter(absl::string_view kind, absl::string_view name)
    : kind_(kind), name_(absl::StrReplaceAll(name, {{";", "_"}})) {
  if (name_.size() > kProgramTextBytesMax || !is_utf8(name_)) name_.clear();
}

ProgramWriter& ProgramWriter::set_place(const Pose& pose) {
  return set("x", pose.position.x()).set("y", pose.position.y()).set("z", pose.position.z());
}

ProgramWriter& ProgramWriter::set_turn(const Pose& pose) {
  const Eigen::Vector3d angles = xml::angles_of(pose.orientation);
  return set("roll", angles.x()).set("pitch", angles.y()).set("yaw", angles.z());
}

absl::Status ProgramWriter::write(xml::Element& link) const {
  const Program* const program = find_program(kind_);
  invariant(program != nullptr, "a system stands for a program that there is");
  for (const auto& [name, value] : numbers_) {
    const NumberSpec* const spec = find_spec(*program, name);
    invariant(spec != nullptr, "a system sets numbers that its program has");
    if (absl::Status status = check_number(*spec, value); !status.ok()) return status;
  }
  for (const auto& [name, id] : ids_) {
    if (absl::StrContains(id, ';'))
      return absl::InvalidArgumentError(absl::StrCat("'", id, "' must not have a ';'"));
  }
  xml::Element& element = *link.InsertNewChildElement(kSystemProgram);
  element.SetAttribute("kind", kind_.c_str());
  if (!name_.empty()) element.SetAttribute("name", name_.c_str());
  for (const auto& [name, value] : numbers_)
    element.SetAttribute(name.c_str(), absl::StrFormat("%.17g", value).c_str());
  for (const auto& [name, id] : ids_) element.SetAttribute(name.c_str(), id.c_str());
  return absl::OkStatus();
}

void write_drive(xml::Element& joint, const char* mode, double target) {
  if (joint.FirstChildElement("tessera:drive") != nullptr) return;
  xml::Element& drive = *joint.InsertNewChildElement("tessera:drive");
  drive.SetAttribute("mode", mode);
  drive.SetAttribute("target", target);
}

}  // namespace tessera::gazebo
