#include "lpss/joints/joint_solver.h"

#include <cstddef>
#include <map>
#include <utility>

#include "lpss/base/disjoint_sets.h"

namespace tessera::joints {

void JointSolver::clear() {
  joints_.clear();
  assemblies_.clear();
}

std::vector<int> JointSolver::bodies() const {
  std::vector<int> bodies;
  for (const SolvedJoint& joint : joints_) {
    bodies.push_back(joint.child);
    if (joint.parent) bodies.push_back(*joint.parent);
  }
  return bodies;
}

void JointSolver::set_up(std::span<const JointedBody> bodies, double dt, int steps) {
  DisjointSets sets(bodies.size());
  std::map<JointId, std::size_t> children;
  for (const SolvedJoint& joint : joints_) {
    const auto child = static_cast<std::size_t>(joint.child);
    children.emplace(joint.id, child);
    if (joint.parent) sets.unite(child, static_cast<std::size_t>(*joint.parent));
  }
  for (const SolvedJoint& joint : joints_) {
    for (const JointAxis& axis : axes_of(*joint.properties)) {
      const auto leader = axis.mimic.is_set() ? children.find(axis.mimic.leader) : children.end();
      if (leader != children.end()) sets.unite(static_cast<std::size_t>(joint.child), leader->second);
    }
  }
  std::map<std::size_t, std::vector<SolvedJoint>> assemblies;
  for (const SolvedJoint& joint : joints_) {
    assemblies[sets.find(static_cast<std::size_t>(joint.child))].push_back(joint);
  }
  for (auto& [first, joints] : assemblies) {
    assemblies_.push_back(std::make_unique<JointAssembly>(std::move(joints), bodies, dt, steps, patterns_));
  }
}

void JointSolver::start_step() {
  for (const auto& assembly : assemblies_) assembly->start_step();
}

void JointSolver::pass() {
  for (const auto& assembly : assemblies_) assembly->pass();
}

void JointSolver::move() {
  for (const auto& assembly : assemblies_) assembly->move();
}

std::vector<BodyMotion> JointSolver::end() {
  std::vector<BodyMotion> moved;
  for (const auto& assembly : assemblies_) assembly->end(moved);
  return moved;
}

}  // namespace tessera::joints
