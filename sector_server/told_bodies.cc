#include "sector_server/told_bodies.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "lpss/model/world_records.h"
#include "sector_server/watched_box.h"

namespace tessera {
namespace {

// The priority of a body that is new to the stream, in batches at the centre of the region.
constexpr double kHeadStart = 8;

// A static body is told by the server that hosts its sector, because all servers know it.
const BodyRecord* hosted_static(const Partition& partition, BodyId id) {
  const BodyRecord* record = partition.statics.find(id);
  return record != nullptr && partition.hosts(record->home) ? record : nullptr;
}

absl::flat_hash_set<BodyId> ids_in(const v1::WatchBodiesRequest& request) {
  absl::flat_hash_set<BodyId> ids;
  for (const std::uint64_t id : request.ids()) ids.insert(BodyId{id});
  return ids;
}

BodyView view_of(const BodyRecord& record) {
  return {record.id, record.home, record.properties, record.state};
}

}  // namespace

// Sorts bodies into those that are to be told and those that are gone.
class ToldBodies::Search {
 public:
  Search(const ToldBodies& told, double sector_size, BodySnapshot& found)
      : told_(told), box_(told.request_, sector_size), found_(found) {}

  bool wants(const SectorIndex& sector) const { return box_.may_hold_bodies_of(sector); }
  bool matches(const BodyView& body) const {
    if (told_.request_.only_awake() && body.state.activity == Activity::kAsleep) return false;
    if (!told_.ids_.empty() && !told_.ids_.contains(body.id)) return false;
    return box_.holds({body.home, Eigen::Vector3d(body.state.position.data())});
  }
  void look_at(const BodyView& body) {
    if (matches(body)) {
      found_.bodies.push_back({body.id, body.home, body.state, centre_frame(body.properties)});
    } else {
      lose(body.id);
    }
  }
  void lose(BodyId id) {
    if (told_.knows(id)) found_.gone.push_back(id);
  }
  double nearness(const BodySnapshot::Body& body) const {
    return box_.nearness({body.home, Eigen::Vector3d(body.state.position.data())});
  }

 private:
  const ToldBodies& told_;
  const WatchedBox box_;
  BodySnapshot& found_;
};

ToldBodies::ToldBodies(const v1::WatchBodiesRequest& request) : request_(request), ids_(ids_in(request)) {}

BodySnapshot ToldBodies::news(const Partition& partition, const BodyChanges& changes, BodySnapshot snapshot,
                              std::size_t bodies_max) {
  snapshot.sector_size = partition.sector_size();
  snapshot.bodies.clear();
  snapshot.gone.clear();
  snapshot.whole = !until_ || !changes.knows_since(*until_);
  look_ = changes.looks();
  next_statics_.reset();
  if (snapshot.whole) {
    told_.clear();
    waiting_.clear();
  }
  Search search(*this, snapshot.sector_size, snapshot);
  if (snapshot.whole) {
    find_all(partition, search);
  } else {
    find_changed(partition, changes, search);
  }
  if (!ids_.empty() && !request_.only_awake()) find_statics(partition, snapshot.whole, search);
  if (!waiting_.empty()) find_waiting(partition, snapshot, search);
  choose(bodies_max, search, snapshot);
  std::sort(snapshot.gone.begin(), snapshot.gone.end());
  snapshot.gone.erase(std::unique(snapshot.gone.begin(), snapshot.gone.end()), snapshot.gone.end());
  return snapshot;
}

void ToldBodies::find_all(const Partition& partition, Search& search) const {
  if (ids_.empty()) {
    for_each_body_in(
        partition, [&](const SectorIndex& sector) { return search.wants(sector); }, request_.only_awake(),
        [&](const BodyView& body) { search.look_at(body); });
    return;
  }
  for (const BodyId id : ids_) {
    if (const std::optional<BodyRecord> record = body_of(partition, id)) search.look_at(view_of(*record));
  }
}

void ToldBodies::find_changed(const Partition& partition, const BodyChanges& changes, Search& search) const {
  changes.for_each_left_since(*until_, [&](BodyId id) {
    if (!knows(id)) return;
    const std::optional<BodyRecord> record = body_of(partition, id);
    if (!record || !search.matches(view_of(*record))) search.lose(id);
  });
  // Whichever are fewer: the bodies that are asked for, or those that have changed.
  if (ids_.empty() || changes.count_since(*until_) <= ids_.size()) {
    changes.for_each_since(
        partition, *until_, [&](const SectorIndex& sector) { return search.wants(sector); },
        [&](const BodyView& body) { search.look_at(body); });
    return;
  }
  for (const BodyId id : ids_) {
    const auto found = partition.bodies.find(id);
    if (found != partition.bodies.end()) {
      if (changes.last_of(found->second->sector->index, id) > *until_)
        search.look_at(view_of(record_of(*found->second)));
      continue;
    }
    for (const SectorIndex& sector : partition.packed.holding(id)) {
      if (changes.last_of(sector, id) > *until_) search.look_at(view_of(*partition.packed.body(id)));
    }
  }
}

void ToldBodies::find_statics(const Partition& partition, bool all, Search& search) {
  const Statics::Versions now{partition.statics.revision(), partition.map.epoch()};
  if (!all && now == statics_.of) return;
  Statics& next = next_statics_.emplace(Statics{now, {}});
  for (const BodyId id : ids_) {
    const auto before = statics_.told.find(id);
    const bool is_known = !all && before != statics_.told.end();
    const BodyRecord* fixed = hosted_static(partition, id);
    if (fixed == nullptr) {
      if (is_known) search.lose(id);
      continue;
    }
    next.told.emplace(id, Place{fixed->home, fixed->state});
    const bool has_moved = !is_known || before->second.home != fixed->home ||
                           before->second.state.position != fixed->state.position ||
                           before->second.state.rotation != fixed->state.rotation;
    if (has_moved) search.look_at(view_of(*fixed));
  }
}

// Those that have not changed again since.
void ToldBodies::find_waiting(const Partition& partition, const BodySnapshot& found, Search& search) const {
  absl::flat_hash_set<BodyId> known;
  for (const BodySnapshot::Body& body : found.bodies) known.insert(body.id);
  for (const auto& [id, priority] : waiting_) {
    if (known.contains(id)) continue;
    if (const std::optional<BodyRecord> record = body_of(partition, id)) {
      search.look_at(view_of(*record));
    } else if (const BodyRecord* fixed = hosted_static(partition, id)) {
      search.look_at(view_of(*fixed));
    }
  }
}

void ToldBodies::choose(std::size_t bodies_max, const Search& search, BodySnapshot& found) {
  next_waiting_.clear();
  found.deferred = 0;
  if (found.bodies.size() <= bodies_max) return;
  std::vector<std::pair<double, std::size_t>> order;
  order.reserve(found.bodies.size());
  for (const BodySnapshot::Body& body : found.bodies) {
    const auto before = waiting_.find(body.id);
    const bool is_new = before == waiting_.end();
    // One that comes from another server, which does not tell of it any more, is not to be missed for long.
    const double waited = !is_new ? before->second : !found.whole && !knows(body.id) ? kHeadStart : 0;
    order.emplace_back(waited + search.nearness(body), order.size());
  }
  const auto is_first = [&](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : found.bodies[a.second].id < found.bodies[b.second].id;
  };
  const auto last = order.begin() + static_cast<std::ptrdiff_t>(bodies_max);
  std::nth_element(order.begin(), last, order.end(), is_first);
  for (auto rest = last; rest != order.end(); ++rest)
    next_waiting_.emplace(found.bodies[rest->second].id, rest->first);
  std::erase_if(found.bodies,
                [this](const BodySnapshot::Body& body) { return next_waiting_.contains(body.id); });
  found.deferred = next_waiting_.size();
}

void ToldBodies::told(const BodySnapshot& news) {
  until_ = look_;
  waiting_ = std::move(next_waiting_);
  next_waiting_.clear();
  if (next_statics_) statics_ = *std::move(next_statics_);
  next_statics_.reset();
  for (const BodySnapshot::Body& body : news.bodies) told_.insert(body.id);
  for (const BodyId id : news.gone) told_.erase(id);
}

}  // namespace tessera
