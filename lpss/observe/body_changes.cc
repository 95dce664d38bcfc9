#include "lpss/observe/body_changes.h"

#include <algorithm>

namespace tessera {

void BodyChanges::look(Partition& partition) {
  ++looks_;
  std::optional<BodyMoves::Notes> notes = partition.body_moves.take();
  if (!notes || known_from_ == 0) {
    forget();
    known_from_ = looks_;
    notes.emplace();
  }
  for (const BodyId id : notes->left) left_.emplace_back(looks_, id);
  while (left_.size() > kLeftMax) {
    known_from_ = left_.front().first;
    left_.pop_front();
  }
  std::sort(notes->arrived.begin(), notes->arrived.end());
  std::vector<SectorIndex> stirred = std::move(notes->stirred);
  stirred.insert(stirred.end(), active_.begin(), active_.end());
  stirred.insert(stirred.end(), notes->arrived.begin(), notes->arrived.end());
  active_.clear();
  for (const Sector* sector : partition.active) active_.push_back(sector->index);
  stirred.insert(stirred.end(), active_.begin(), active_.end());
  std::sort(stirred.begin(), stirred.end());
  stirred.erase(std::unique(stirred.begin(), stirred.end()), stirred.end());
  for (const SectorIndex& index : stirred)
    look_at(partition, index, std::binary_search(notes->arrived.begin(), notes->arrived.end(), index));
}

void BodyChanges::forget() {
  known_from_ = 0;
  changed_.clear();
  places_.clear();
  active_.clear();
  left_.clear();
}

void BodyChanges::look_at(const Partition& partition, const SectorIndex& index, bool arrived) {
  const auto known = places_.find(index);
  const auto found = partition.sectors.find(index);
  bool active = false;
  scratch_.clear();
  if (found != partition.sectors.end()) {
    const Sector& sector = *found->second;
    active = sector.active;
    for (const HomeBody* body : sector.homes)
      scratch_.push_back({body->id, 0, sector.world->activity(body->slot) != Activity::kAsleep});
  } else if (partition.packed.contains(index)) {
    partition.packed.for_each_body(index, [&](const BodyRecord& record) {
      scratch_.push_back({record.id, 0, false});
    });
  }
  if (scratch_.empty()) {
    if (known == places_.end()) return;
    changed_.erase(known->second);
    places_.erase(known);
    return;
  }
  const bool is_news = compare(known == places_.end() ? nullptr : &*known->second, arrived);
  if (known == places_.end()) {
    if (!is_news) return;
    changed_.push_back({index, looks_, active, scratch_});
    places_.emplace(index, std::prev(changed_.end()));
    return;
  }
  Changed& changed = *known->second;
  changed.active = active;
  changed.bodies.swap(scratch_);
  if (!is_news) return;
  changed.at = looks_;
  changed_.splice(changed_.end(), changed_, known->second);
}

// Whether a body in scratch_, which are those of a sector now, has changed at this look, and when each has.
// Of a sector that was not known, all bodies that are asleep have been so since long ago.
bool BodyChanges::compare(const Changed* known, bool arrived) {
  static const std::vector<Body> kNone;
  const std::vector<Body>& before = known != nullptr ? known->bodies : kNone;
  bool is_news = false;
  auto old = before.begin();
  for (Body& body : scratch_) {
    while (old != before.end() && old->id < body.id) ++old;
    const bool is_old = old != before.end() && old->id == body.id;
    const bool has_changed = body.awake || arrived || (is_old ? old->awake : known != nullptr);
    body.at = has_changed ? looks_ : is_old ? old->at : 0;
    is_news |= has_changed;
  }
  return is_news;
}

void BodyChanges::for_each_since(const Partition& partition, std::uint64_t look,
                                 absl::FunctionRef<bool(const SectorIndex&)> wants,
                                 absl::FunctionRef<void(const BodyView&)> visit) const {
  for (auto changed = changed_.rbegin(); changed != changed_.rend() && changed->at > look; ++changed) {
    if (!wants(changed->sector)) continue;
    auto body = changed->bodies.begin();
    const auto has_changed = [&](BodyId id) {
      while (body != changed->bodies.end() && body->id < id) ++body;
      return body != changed->bodies.end() && body->id == id && body->at > look;
    };
    if (const auto found = partition.sectors.find(changed->sector); found != partition.sectors.end()) {
      const Sector& sector = *found->second;
      for (const HomeBody* home : sector.homes) {
        if (has_changed(home->id))
          visit({home->id, sector.index, home->properties, sector.world->state(home->slot)});
      }
    } else if (partition.packed.contains(changed->sector)) {
      partition.packed.for_each_body(changed->sector, [&](const BodyRecord& record) {
        if (has_changed(record.id)) visit({record.id, record.home, record.properties, record.state});
      });
    }
  }
}

std::size_t BodyChanges::count_since(std::uint64_t look) const {
  std::size_t bodies = 0;
  for (auto changed = changed_.rbegin(); changed != changed_.rend() && changed->at > look; ++changed)
    bodies += changed->bodies.size();
  return bodies;
}

std::uint64_t BodyChanges::last_of(const SectorIndex& sector, BodyId id) const {
  const auto known = places_.find(sector);
  if (known == places_.end()) return 0;
  const std::vector<Body>& bodies = known->second->bodies;
  const auto found = std::lower_bound(bodies.begin(), bodies.end(), id,
                                      [](const Body& body, BodyId wanted) { return body.id < wanted; });
  return found != bodies.end() && found->id == id ? found->at : 0;
}

void BodyChanges::for_each_left_since(std::uint64_t look, absl::FunctionRef<void(BodyId)> visit) const {
  for (auto left = left_.rbegin(); left != left_.rend() && left->first > look; ++left) visit(left->second);
}

void BodyChanges::drop_until(std::uint64_t look) {
  while (!changed_.empty() && changed_.front().at <= look && !changed_.front().active) {
    places_.erase(changed_.front().sector);
    changed_.pop_front();
  }
  while (!left_.empty() && left_.front().first <= look) left_.pop_front();
  known_from_ = std::max(known_from_, known_from_ > 0 ? std::min(look, looks_) : 0);
}

}  // namespace tessera
