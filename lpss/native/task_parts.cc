#include "lpss/native/task_parts.h"

#include <algorithm>
#include <functional>
#include <limits>

#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

// The share of a rotor's turn that counts where nothing holds it: in a step it may turn six times as far as
// other bodies.
constexpr double kResisted = 0.16;

// The place of a body in its task; Body::kNoPlace for bodies that do not move, or are not in the task.
std::size_t place_of(const WorldBody& place) {
  if (place.world == nullptr) return Body::kNoPlace;
  const Body& body = body_of(place);
  return body.is_dynamic() ? body.place : Body::kNoPlace;
}

void clear(SolveTask& task) {
  task.bodies.clear();
  task.clones.clear();
  task.contacts.clear();
  task.joints.clear();
}

}  // namespace

std::span<const TaskPart> TaskParts::of(const SolveTask& task, const ContactNeeds& needs, double dt,
                                        const ParallelFor& parallel) {
  connect(task, parallel);
  find_steps(task, needs, dt);
  parts_.clear();
  for (std::size_t body = 0; body < task.bodies.size(); ++body) {
    const int wanted = steps_[islands_.find(body)];
    if (std::ranges::find(parts_, wanted, &TaskPart::steps) == parts_.end())
      parts_.push_back({wanted, &task});
  }
  if (parts_.size() > 1) divide(task);
  return parts_;
}

void TaskParts::connect(const SolveTask& task, const ParallelFor& parallel) {
  constexpr std::size_t kContactsInPiece = 256;
  touches_.resize(task.contacts.size());
  run_in_pieces(parallel, task.contacts.size(), kContactsInPiece, [&](std::size_t n) {
    const WorldPair& contact = task.contacts[n];
    const ContactPair& pair = contact.world->contacts()[contact.pair];
    touches_[n] = {place_of({contact.world, pair.slot_a}), place_of({contact.world, pair.slot_b}),
                   contact.substeps > 0 ? contact.substeps : pair.substeps};
  });
  islands_.reset(task.bodies.size());
  const auto unite = [&](std::size_t a, std::size_t b) {
    if (a != Body::kNoPlace && b != Body::kNoPlace) islands_.unite(a, b);
  };
  for (const Touch& touch : touches_) unite(touch.a, touch.b);
  for (const TaskJoint& joint : task.joints) {
    unite(place_of(joint.child), place_of(joint.parent));
    for (const JointAxis& axis : axes_of(*joint.properties)) {
      if (!axis.mimic.is_set()) continue;
      const auto leader =
          std::ranges::lower_bound(task.joints, axis.mimic.leader, std::ranges::less{}, &TaskJoint::id);
      if (leader != task.joints.end() && leader->id == axis.mimic.leader)
        unite(place_of(joint.child), place_of(leader->child));
    }
  }
}

void TaskParts::find_steps(const SolveTask& task, const ContactNeeds& needs, double dt) {
  steps_.assign(task.bodies.size(), needs.least());
  for (const Touch& touch : touches_) ask(touch.pushed(), touch.substeps);
  sizes_.assign(task.bodies.size(), 0);
  for (std::size_t body = 0; body < task.bodies.size(); ++body) ++sizes_[islands_.find(body)];
  for (std::size_t island = 0; island < task.bodies.size(); ++island)
    steps_[island] = needs.granted(steps_[island], sizes_[island]);
  if (task.joints.empty()) return;
  ask_for_turns(task, needs, dt);
  ask_for_loads(task, needs);
}

// The island of a body asks for so many.
void TaskParts::ask(std::size_t body, int steps) {
  if (body == Body::kNoPlace) return;
  int& most = steps_[islands_.find(body)];
  most = std::max(most, steps);
}

// A rotor may turn about its axis as fast as it likes, but it resists a tilt, and what holds it takes that
// up. Passes find how, which takes more steps where that is light beside the rotor.
void TaskParts::ask_for_turns(const SolveTask& task, const ContactNeeds& needs, double dt) {
  turning_.assign(task.bodies.size(), {});
  const auto see = [&](const TaskJoint& joint, const WorldBody& side, const WorldBody& other) {
    const std::size_t place = place_of(side);
    if (place == Body::kNoPlace) return;
    const Body& body = body_of(side);
    const bool is_child = &side == &joint.child;
    Turning& turning = turning_[place];
    turning.is_tied = true;
    turning.rotor.add(joint.properties->type, is_child,
                      is_child ? joint.properties->in_child : joint.properties->in_parent,
                      double(body.inverse_mass), body.inverse_moments.cast<double>());
    if (!turning.rotor.axis()) return;
    const double carrier = place_of(other) == Body::kNoPlace ? std::numeric_limits<double>::infinity()
                                                             : double(body_of(other).moments.minCoeff());
    turning.carrier_moment = std::max(turning.carrier_moment, carrier);
  };
  for (const TaskJoint& joint : task.joints) {
    see(joint, joint.child, joint.parent);
    see(joint, joint.parent, joint.child);
  }
  for (std::size_t place = 0; place < task.bodies.size(); ++place) {
    const Body& body = body_of(task.bodies[place]);
    if (!turning_[place].is_tied) continue;
    const Eigen::Vector3d rate = body.angular.cast<double>();
    double turn = rate.norm();
    if (const auto& axis_in_body = turning_[place].rotor.axis()) {
      const Eigen::Vector3d axis = body.pose.rotation.cast<double>() * *axis_in_body;
      const Eigen::Vector3d tilt = joints::tilt_rate(axis, rate);
      const Eigen::Vector3d moments = body.moments.cast<double>();
      const double about = axis_in_body->dot(moments.cwiseProduct(*axis_in_body));
      const double resists = about / ((moments.sum() - about) / 2 + turning_[place].carrier_moment);
      turn = std::min(turn, std::max(tilt.norm(), kResisted * resists * (rate - tilt).norm()));
    }
    ask(place, needs.for_turn(turn * dt));
  }
}

// Takes off what hangs on a single joint, again and again: what is left are loops, and what holds all of it.
// The order in an island does not depend on others.
void TaskParts::ask_for_loads(const SolveTask& task, const ContactNeeds& needs) {
  hanging_.assign(task.bodies.size(), {});
  for (std::size_t body = 0; body < task.bodies.size(); ++body)
    hanging_[body].mass = 1 / double(body_of(task.bodies[body]).inverse_mass);
  for (std::size_t n = 0; n < task.joints.size(); ++n) {
    for (const WorldBody& side : {task.joints[n].child, task.joints[n].parent}) {
      const std::size_t body = place_of(side);
      if (body == Body::kNoPlace) continue;
      ++hanging_[body].joints;
      hanging_[body].all ^= n;
    }
  }
  ends_.clear();
  for (std::size_t body = 0; body < task.bodies.size(); ++body) {
    if (hanging_[body].joints == 1) ends_.push_back(body);
  }
  for (std::size_t n = 0; n < ends_.size(); ++n) {
    Hanging& end = hanging_[ends_[n]];
    if (end.joints == 0) continue;  // the last of a tree that nothing holds
    const TaskJoint& joint = task.joints[end.all];
    const bool is_child = place_of(joint.child) == ends_[n];
    const WorldBody& above = is_child ? joint.parent : joint.child;
    const std::size_t holder = place_of(above);
    if (holder == Body::kNoPlace) continue;  // the world holds it
    const Eigen::Vector3d lever =
        (is_child ? joint.properties->in_parent : joint.properties->in_child).position;
    const Eigen::Vector3d mobilities = body_of(above).inverse_moments.cast<double>();
    const double across =
        mobilities.sum() - mobilities.dot(lever.cwiseAbs2()) / std::max(lever.squaredNorm(), 1e-30);
    ask(holder, needs.for_pull(end.mass, lever.norm(), across));
    hanging_[holder].mass += end.mass;
    hanging_[holder].all ^= end.all;
    end.joints = 0;
    if (--hanging_[holder].joints == 1) ends_.push_back(holder);
  }
}

void TaskParts::divide(const SolveTask& task) {
  if (tasks_.size() < parts_.size()) tasks_.resize(parts_.size());
  for (std::size_t n = 0; n < parts_.size(); ++n) {
    clear(tasks_[n]);
    parts_[n].task = &tasks_[n];
  }
  const auto part_of = [&](std::size_t body) -> SolveTask& {
    const auto part = std::ranges::find(parts_, steps_[islands_.find(body)], &TaskPart::steps);
    return tasks_[static_cast<std::size_t>(part - parts_.begin())];
  };
  places_.resize(task.bodies.size());
  for (std::size_t i = 0; i < task.bodies.size(); ++i) {
    SolveTask& part = part_of(i);
    places_[i] = part.bodies.size();
    part.bodies.push_back(task.bodies[i]);
  }
  for (const SolveTask::CloneOf& clone : task.clones) {
    part_of(clone.original).clones.push_back({clone.clone, places_[clone.original]});
  }
  for (std::size_t i = 0; i < task.contacts.size(); ++i) {
    const std::size_t body = touches_[i].pushed();
    if (body != Body::kNoPlace) part_of(body).contacts.push_back(task.contacts[i]);
  }
  for (const TaskJoint& joint : task.joints) {
    if (const std::size_t child = place_of(joint.child); child != Body::kNoPlace) {
      part_of(child).joints.push_back(joint);
    }
  }
}

}  // namespace tessera::native
