#include "lpss/bullet/task_parts.h"

#include <absl/container/flat_hash_map.h>

#include <array>
#include <optional>
#include <utility>

#include "lpss/seam/island_graph.h"

namespace tessera::bullet {
namespace {

class Parting {
 public:
  explicit Parting(const SolveTask& task) : task_(task), islands_(task.bodies.size()) {
    for (std::size_t i = 0; i < task.bodies.size(); ++i) places_[key(task.bodies[i])] = i;
    for (const SolveTask::CloneOf& clone : task.clones) places_[key(clone.clone)] = clone.original;
  }

  TaskParts parts() {
    connect();
    std::vector<char> has_joint(task_.bodies.size(), 0);
    for (const TaskJoint& joint : task_.joints) {
      if (const auto child = place_of(joint.child)) has_joint[islands_.find(*child)] = 1;
    }
    TaskParts parts;
    std::vector<std::size_t> moved(task_.bodies.size());
    const auto part_of = [&](std::size_t body) -> SolveTask& {
      return has_joint[islands_.find(body)] ? parts.jointed : parts.loose;
    };
    for (std::size_t i = 0; i < task_.bodies.size(); ++i) {
      SolveTask& part = part_of(i);
      moved[i] = part.bodies.size();
      part.bodies.push_back(task_.bodies[i]);
    }
    for (const SolveTask::CloneOf& clone : task_.clones) {
      part_of(clone.original).clones.push_back({clone.clone, moved[clone.original]});
    }
    for (const WorldPair& contact : task_.contacts) {
      const auto [a, b] = bodies_of(contact);
      if (a || b) part_of(a ? *a : *b).contacts.push_back(contact);
    }
    parts.jointed.joints = task_.joints;
    return parts;
  }

 private:
  using Key = std::pair<const SectorWorld*, BodySlot>;

  static Key key(const WorldBody& body) { return {body.world, body.slot}; }

  std::optional<std::size_t> place_of(const WorldBody& body) const {
    const auto found = places_.find(key(body));
    if (found == places_.end()) return std::nullopt;
    return found->second;
  }

  std::array<std::optional<std::size_t>, 2> bodies_of(const WorldPair& contact) const {
    const ContactPair& pair = contact.world->contacts()[contact.pair];
    return {place_of({contact.world, pair.slot_a}), place_of({contact.world, pair.slot_b})};
  }

  void connect() {
    for (const WorldPair& contact : task_.contacts) {
      const auto [a, b] = bodies_of(contact);
      if (a && b) islands_.unite(*a, *b);
    }
    for (const TaskJoint& joint : task_.joints) {
      const auto child = place_of(joint.child);
      const auto parent = place_of(joint.parent);
      if (child && parent) islands_.unite(*child, *parent);
    }
  }

  const SolveTask& task_;
  DisjointSets islands_;
  absl::flat_hash_map<Key, std::size_t> places_;
};

}  // namespace

TaskParts parts_of(const SolveTask& task) { return Parting(task).parts(); }

}  // namespace tessera::bullet
