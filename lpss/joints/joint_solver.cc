#include "lpss/joints/joint_solver.h"

#include <algorithm>
#include <map>

namespace tessera::joints {
namespace {

constexpr std::size_t kNoAssembly = static_cast<std::size_t>(-1);

// Connects bodies by axes that follow others.
void unite_mimics(std::span<const SolvedJoint> joints, DisjointSets& sets) {
  const auto follows = [](const JointAxis& axis) { return axis.mimic.is_set(); };
  if (std::ranges::none_of(joints, [&](const SolvedJoint& joint) {
        return std::ranges::any_of(axes_of(*joint.form), follows);
      })) {
    return;
  }
  std::map<JointId, std::size_t> children;
  for (const SolvedJoint& joint : joints) children.emplace(joint.id, static_cast<std::size_t>(joint.child));
  for (const SolvedJoint& joint : joints) {
    for (const JointAxis& axis : axes_of(*joint.form)) {
      const auto leader = axis.mimic.is_set() ? children.find(axis.mimic.leader) : children.end();
      if (leader != children.end()) sets.unite(static_cast<std::size_t>(joint.child), leader->second);
    }
  }
}

}  // namespace

void JointSolver::clear() {
  joints_.clear();
  count_ = 0;
}

std::span<const std::size_t> JointSolver::bodies() {
  bodies_.clear();
  for (const SolvedJoint& joint : joints_) {
    bodies_.push_back(static_cast<std::size_t>(joint.child));
    if (joint.parent) bodies_.push_back(static_cast<std::size_t>(*joint.parent));
  }
  std::ranges::sort(bodies_);
  bodies_.erase(std::unique(bodies_.begin(), bodies_.end()), bodies_.end());
  return bodies_;
}

void JointSolver::set_up(std::span<const JointedBody> bodies, double dt, int steps) {
  sets_.reset(bodies.size());
  for (const SolvedJoint& joint : joints_) {
    if (joint.parent)
      sets_.unite(static_cast<std::size_t>(joint.child), static_cast<std::size_t>(*joint.parent));
  }
  unite_mimics(joints_, sets_);
  assembly_of_.assign(bodies.size(), kNoAssembly);
  places_.assign(bodies.size(), JointAssembly::kNoPlace);
  for (const SolvedJoint& joint : joints_)
    assembly_of(static_cast<std::size_t>(joint.child)).add(joint, bodies, places_);
  for (const auto& assembly : assemblies()) assembly->begin(dt, steps);
}

JointAssembly& JointSolver::assembly_of(std::size_t body) {
  std::size_t& assembly = assembly_of_[sets_.find(body)];
  if (assembly == kNoAssembly) {
    assembly = count_++;
    if (assembly == assemblies_.size()) assemblies_.push_back(std::make_unique<JointAssembly>(patterns_));
    assemblies_[assembly]->clear();
  }
  return *assemblies_[assembly];
}

void JointSolver::start_step() {
  for (const auto& assembly : assemblies()) assembly->start_step();
}

void JointSolver::pass() {
  for (const auto& assembly : assemblies()) assembly->pass();
}

void JointSolver::pass_if_pushed() {
  for (const auto& assembly : assemblies()) {
    if (assembly->is_pushed()) assembly->pass();
  }
}

void JointSolver::pass_untouched() {
  for (const auto& assembly : assemblies()) {
    if (assembly->touched() == 0) assembly->pass();
  }
}

void JointSolver::move() {
  for (const auto& assembly : assemblies()) assembly->move();
}

void JointSolver::end_step() {
  for (const auto& assembly : assemblies()) assembly->end_step();
}

std::span<const BodyMotion> JointSolver::end() {
  moved_.clear();
  for (const auto& assembly : assemblies()) assembly->end(moved_);
  return moved_;
}

void JointSolver::write_impulses(std::span<JointLoads> impulses) const {
  for (const auto& assembly : assemblies()) assembly->write_impulses(impulses);
}

}  // namespace tessera::joints
