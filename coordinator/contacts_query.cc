// Contacts of bodies: the server that detects a pair knows its patches.

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "coordinator/limits.h"
#include "coordinator/query_kinds.h"
#include "lpss/model/checks.h"

namespace tessera {

absl::StatusOr<AskedQuery> ask(const v1::ContactsQuery& query, const WorldRegistry& world) {
  if (query.bodies().empty() && query.name_prefix().empty())
    return refused("bodies or name_prefix must say whose contacts are asked for");
  std::set<std::uint64_t> ids;
  for (const v1::BodyRef& body : query.bodies()) {
    const absl::StatusOr<BodyId> id = world.resolve(body);
    if (!id.ok()) return in("bodies", id.status());
    ids.insert(id->value);
  }
  if (!query.name_prefix().empty()) {
    for (const BodyId id : world.with_prefix(query.name_prefix())) ids.insert(id.value);
  }
  const std::uint64_t limit =
      std::min(query.limit() == 0 ? kFoundBodiesDefault : query.limit(), kFoundBodiesMax);
  AskedQuery ask;
  v1::ContactsQuery& asked = *ask.asked.emplace_back().mutable_contacts();
  asked.set_limit(limit);
  for (const std::uint64_t id : ids) asked.add_bodies()->set_id(id);
  ask.finish = [limit](std::span<Parts> parts, const WorldRegistry&, v1::QueryResult& result) {
    std::vector<v1::Contact> all;
    bool truncated = false;
    for (v1::PartialResult& part : parts[0]) {
      v1::FoundContacts& found = *part.mutable_result()->mutable_contacts();
      truncated = truncated || found.truncated();
      std::move(found.mutable_contacts()->begin(), found.mutable_contacts()->end(), std::back_inserter(all));
    }
    std::ranges::stable_sort(all, {}, [](const v1::Contact& x) { return std::pair(x.a(), x.b()); });
    v1::FoundContacts& merged = *result.mutable_contacts();
    merged.set_truncated(truncated || all.size() > limit);
    if (all.size() > limit) all.resize(limit);
    for (v1::Contact& contact : all) *merged.add_contacts() = std::move(contact);
    return absl::OkStatus();
  };
  return ask;
}

}  // namespace tessera
