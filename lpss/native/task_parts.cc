#include "lpss/native/task_parts.h"

#include <algorithm>
#include <utility>

#include "lpss/base/disjoint_sets.h"
#include "lpss/native/island_needs.h"
#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

// The place of a body in its task; kGround for bodies that do not move, or are not in the task.
std::size_t place_of(const WorldBody& place) {
  if (place.world == nullptr) return ContactEdge::kGround;
  const Body& body = body_of(place);
  return body.is_dynamic() && body.place != Body::kNoPlace ? body.place : ContactEdge::kGround;
}

ContactEdge edge_of(const WorldPair& contact) {
  const ContactPair& pair = contact.world->contacts()[contact.pair];
  return {place_of(WorldBody{contact.world, pair.slot_a}), place_of(WorldBody{contact.world, pair.slot_b})};
}

class Parting {
 public:
  Parting(const SolveTask& task, int usual_steps, double dt)
      : task_(task), usual_steps_(usual_steps), dt_(dt), islands_(task.bodies.size()) {}

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
      const std::size_t body = std::min(touches_[i].a, touches_[i].b);
      if (body != ContactEdge::kGround) part_of(body).contacts.push_back(task_.contacts[i]);
    }
    for (const TaskJoint& joint : task_.joints) {
      if (const std::size_t child = place_of(joint.child); child != ContactEdge::kGround) {
        part_of(child).joints.push_back(joint);
      }
    }
    return parts;
  }

 private:
  void connect() {
    const auto unite = [&](std::size_t a, std::size_t b) {
      if (a != ContactEdge::kGround && b != ContactEdge::kGround) islands_.unite(a, b);
    };
    touches_.reserve(task_.contacts.size());
    for (const WorldPair& contact : task_.contacts) {
      touches_.push_back(edge_of(contact));
      unite(touches_.back().a, touches_.back().b);
    }
    for (const TaskJoint& joint : task_.joints) unite(place_of(joint.child), place_of(joint.parent));
  }

  // By the first body of each island.
  std::vector<int> steps_of_islands() {
    std::vector<double> masses;
    masses.reserve(task_.bodies.size());
    for (const WorldBody& body : task_.bodies) masses.push_back(1 / double(body_of(body).inverse_mass));
    const std::vector<double> carried = load_ratios(masses, touches_);
    std::vector<int> steps(task_.bodies.size(), 0);
    for (std::size_t i = 0; i < carried.size(); ++i) {
      int& most = steps[islands_.find(i)];
      const double fall = double(body_of(task_.bodies[i]).force.norm()) / masses[i] * dt_ * dt_;
      most = std::max(most, steps_for(load_in_tick(carried[i], fall), usual_steps_));
    }
    // Bodies that hang on joints do not count as load.
    for (const TaskJoint& joint : task_.joints) {
      for (const WorldBody& side : {joint.child, joint.parent}) {
        const std::size_t body = place_of(side);
        if (body == ContactEdge::kGround) continue;
        int& most = steps[islands_.find(body)];
        const double turn = double(body_of(side).angular.norm()) * dt_;
        most = std::max(most, steps_for_turn(turn, usual_steps_));
      }
    }
    return steps;
  }

  const SolveTask& task_;
  const int usual_steps_;
  const double dt_;  // s
  DisjointSets islands_;
  std::vector<ContactEdge> touches_;  // of the task's contacts
};

}  // namespace

std::vector<TaskPart> parts_of(const SolveTask& task, int usual_steps, double dt) {
  return Parting(task, usual_steps, dt).parts();
}

}  // namespace tessera::native
