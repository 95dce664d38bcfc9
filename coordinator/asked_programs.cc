// Programs of bodies: each server tells of those that it hosts.
#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "coordinator/limits.h"
#include "coordinator/query_kinds.h"

namespace tessera {
namespace {

using Found = v1::FoundPrograms::Found;

v1::FoundPrograms found_in(Parts& parts, std::size_t limit, const WorldRegistry& world) {
  std::vector<Found> all;
  for (v1::PartialResult& part : parts) {
    for (Found& found : *part.mutable_result()->mutable_programs()->mutable_programs())
      all.push_back(std::move(found));
  }
  std::ranges::sort(all, {}, [](const Found& found) { return std::pair(found.body(), found.program()); });
  v1::FoundPrograms result;
  result.set_truncated(all.size() > limit);
  if (all.size() > limit) all.resize(limit);
  for (Found& found : all) {
    if (const WorldRegistry::Entry* const body = world.find(BodyId{found.body()})) found.set_name(body->name);
    *result.add_programs() = std::move(found);
  }
  return result;
}

}  // namespace

absl::StatusOr<AskedQuery> ask(const v1::ProgramsQuery& query, const WorldRegistry& world) {
  const std::uint64_t wanted = query.limit() == 0 ? kFoundBodiesDefault : query.limit();
  const std::size_t limit = std::min(wanted, kFoundBodiesMax);
  AskedQuery ask;
  v1::ProgramsQuery& asked = *ask.asked.emplace_back().mutable_programs();
  asked.set_limit(limit);
  std::set<std::uint64_t> ids(query.ids().begin(), query.ids().end());
  if (!query.name_prefix().empty()) {
    for (const BodyId id : world.with_prefix(query.name_prefix())) {
      if (!world.find(id)->tags.programs.empty()) ids.insert(id.value);
    }
    // None of that name has programs: nobody is asked for all.
    if (ids.empty()) ids.insert(0);
  }
  asked.mutable_ids()->Add(ids.begin(), ids.end());
  ask.finish = [limit](std::span<Parts> parts, const WorldRegistry& registry, v1::QueryResult& result) {
    *result.mutable_programs() = found_in(parts[0], limit, registry);
    return absl::OkStatus();
  };
  return ask;
}

}  // namespace tessera
