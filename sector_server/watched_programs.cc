#include "sector_server/watched_programs.h"

#include <absl/strings/match.h>

#include <algorithm>
#include <iterator>

namespace tessera {
namespace {

std::uint32_t place_of(const std::string& kind, google::protobuf::RepeatedPtrField<std::string>& kinds) {
  const auto found = std::ranges::find(kinds, kind);
  const auto place = static_cast<std::uint32_t>(std::distance(kinds.begin(), found));
  if (found == kinds.end()) *kinds.Add() = kind;
  return place;
}

}  // namespace

WatchedPrograms::WatchedPrograms(const v1::WatchProgramsRequest& request)
    : ids_(request.ids().begin(), request.ids().end()), kind_(request.kind()) {}

// The kind of a module is its name, @ and a checksum.
bool WatchedPrograms::wants(const std::string& kind) const {
  if (!absl::StartsWith(kind, kind_)) return false;
  return kind_.empty() || kind.size() == kind_.size() || kind[kind_.size()] == '@';
}

void WatchedPrograms::add_those_of(const ProgramsView& of, v1::ProgramBatch& batch) const {
  if (!ids_.empty() && !ids_.contains(of.id.value)) return;
  for (std::uint32_t place = 0; place < of.programs.size(); ++place) {
    const ProgramRecord& program = of.programs[place];
    if (!wants(program.kind)) continue;
    batch.add_bodies(of.id.value);
    batch.add_programs(place);
    batch.add_kind(place_of(program.kind, *batch.mutable_kinds()));
    batch.add_counts(static_cast<std::uint32_t>(program.values.size()));
    batch.add_stopped(!program.fault.empty());
    batch.mutable_values()->Add(program.values.begin(), program.values.end());
  }
}

}  // namespace tessera
