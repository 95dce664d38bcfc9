#include "lpss/native/task_parts.h"

#include <algorithm>
#include <utility>

#include "lpss/base/disjoint_sets.h"
#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

// The place of a body in its task; Body::kNoPlace for bodies that do not move, or are not in the task.
std::size_t place_of(const WorldBody& place) {
  if (place.world == nullptr) return Body::kNoPlace;
  const Body& body = body_of(place);
  return body.is_dynamic() ? body.place : Body::kNoPlace;
}

class Parting {
 public:
  Parting(const SolveTask& task, const ContactNeeds& needs, double dt)
      : task_(task), needs_(needs), dt_(dt), islands_(task.bodies.size()) {}

  std::vector<TaskPart> parts() {
    connect();
    const std::vector<int> steps = steps_of_islands();
    std::vector<TaskPart> parts;
    const auto part_of = [&](std::size_t body) -> SolveTask& {
      const int wanted = steps[islands_.find(body)];
      const auto known = std::ranges::find(parts, wanted, &TaskPart::steps);
      return known != parts.end() ? known->task : parts.emplace_back(TaskPart{wanted, {}}).task;
    };
    std::vector<std::size_t> moved(task_.bodies.size());
    for (std::size_t i = 0; i < task_.bodies.size(); ++i) {
      SolveTask& part = part_of(i);
      moved[i] = part.bodies.size();
      part.bodies.push_back(task_.bodies[i]);
    }
    for (const SolveTask::CloneOf& clone : task_.clones) {
      part_of(clone.original).clones.push_back({clone.clone, moved[clone.original]});
    }
    for (std::size_t i = 0; i < task_.contacts.size(); ++i) {
      const std::size_t body = pushed_[i];
      if (body != Body::kNoPlace) part_of(body).contacts.push_back(task_.contacts[i]);
    }
    for (const TaskJoint& joint : task_.joints) {
      if (const std::size_t child = place_of(joint.child); child != Body::kNoPlace) {
        part_of(child).joints.push_back(joint);
      }
    }
    return parts;
  }

 private:
  void connect() {
    const auto unite = [&](std::size_t a, std::size_t b) {
      if (a != Body::kNoPlace && b != Body::kNoPlace) islands_.unite(a, b);
    };
    pushed_.reserve(task_.contacts.size());
    for (const WorldPair& contact : task_.contacts) {
      const ContactPair& pair = contact.world->contacts()[contact.pair];
      const std::size_t a = place_of({contact.world, pair.slot_a});
      const std::size_t b = place_of({contact.world, pair.slot_b});
      pushed_.push_back(std::min(a, b));
      unite(a, b);
    }
    for (const TaskJoint& joint : task_.joints) unite(place_of(joint.child), place_of(joint.parent));
  }

  // By the first body of each island.
  std::vector<int> steps_of_islands() {
    std::vector<int> steps(task_.bodies.size(), needs_.least());
    const auto ask = [&](std::size_t body, int wanted) {
      if (body == Body::kNoPlace) return;
      int& most = steps[islands_.find(body)];
      most = std::max(most, wanted);
    };
    for (std::size_t i = 0; i < task_.contacts.size(); ++i) {
      const WorldPair& contact = task_.contacts[i];
      ask(pushed_[i], task_.substeps > 0 ? task_.substeps : contact.world->contacts()[contact.pair].substeps);
    }
    for (const TaskJoint& joint : task_.joints) {
      for (const WorldBody& side : {joint.child, joint.parent}) {
        const std::size_t body = place_of(side);
        if (body != Body::kNoPlace) ask(body, needs_.for_turn(double(body_of(side).angular.norm()) * dt_));
      }
    }
    return steps;
  }

  const SolveTask& task_;
  const ContactNeeds& needs_;
  const double dt_;  // s
  DisjointSets islands_;
  std::vector<std::size_t> pushed_;  // by contact: a body that it pushes; kNoPlace if none
};

}  // namespace

std::vector<TaskPart> parts_of(const SolveTask& task, const ContactNeeds& needs, double dt) {
  return Parting(task, needs, dt).parts();
}

}  // namespace tessera::native
