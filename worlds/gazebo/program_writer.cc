#include "worlds/gazebo/program_writer.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_replace.h>

#include <algorithm>

#include "lpss/base/invariant.h"
#include "lpss/base/portable_math.h"
#include "lpss/base/utf8.h"
#include "lpss/model/limits.h"
#include "lpss/programs/registry.h"

namespace tessera::gazebo {
namespace {

const NumberSpec* find_spec(const Program& program, absl::string_view name) {
  for (const auto table : {program.parameters(), program.inputs()}) {
    if (const auto place = place_of(name, table)) return &table[*place];
  }
  return nullptr;
}

}  // namespace

Eigen::Vector3d angles_of(const Eigen::Quaterniond& q) {
  const double sine = std::clamp(2 * (q.w() * q.y() - q.z() * q.x()), -1.0, 1.0);
  const double roll =
      portable::atan2(2 * (q.w() * q.x() + q.y() * q.z()), 1 - 2 * (q.x() * q.x() + q.y() * q.y()));
  const double yaw =
      portable::atan2(2 * (q.w() * q.z() + q.x() * q.y()), 1 - 2 * (q.y() * q.y() + q.z() * q.z()));
  return {roll, portable::asin(sine), yaw};
}

ProgramWriter::ProgramWriter(absl::string_view kind, absl::string_view name)
    : kind_(kind), name_(absl::StrReplaceAll(name, {{";", "_"}})) {
  if (name_.size() > kProgramTextBytesMax || !is_utf8(name_)) name_.clear();
}

ProgramWriter& ProgramWriter::set_place(const Pose& pose) {
  return set("x", pose.position.x()).set("y", pose.position.y()).set("z", pose.position.z());
}

ProgramWriter& ProgramWriter::set_turn(const Pose& pose) {
  const Eigen::Vector3d angles = angles_of(pose.orientation);
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

}  // namespace tessera::gazebo
