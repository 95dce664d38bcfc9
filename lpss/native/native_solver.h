// Solves islands in small steps: their contacts by lpss/solver/contact_solver.h, their joints by
// lpss/bullet/joint_solver.h, in turns.
#pragma once

#include <LinearMath/btVector3.h>
#include <absl/container/flat_hash_map.h>

#include <vector>

#include "lpss/bullet/joint_solver.h"
#include "lpss/native/body.h"
#include "lpss/native/contact.h"
#include "lpss/solver/contact_solver.h"

namespace tessera::native {

class NativeSolver final : public IslandSolver {
 public:
  explicit NativeSolver(const EngineSettings& settings);

  void solve(const SolveTask& task, double dt) override;

 private:
  using Contacts = ContactSolver<Scalar>;

  void solve(const SolveTask& task, double dt, int steps);
  void add_body(Body& body);
  std::size_t place_of(const WorldBody& body);
  void add_contact(const WorldPair& pair);
  void begin_joints();
  template <typename Act>
  void with_joints(Act act);
  void find_corrections();
  void write_impulses() const;
  void write_bodies() const;

  const EngineSettings settings_;
  const int passes_;  // of a step, biased and relaxed
  double dt_ = 0;     // s
  int steps_ = 0;
  Contacts contacts_;
  bullet::JointSolver joints_;
  std::vector<Body*> dynamics_;  // they come first
  std::vector<Contacts::Body> bodies_;
  std::vector<bool> is_pushed_;  // has rows
  absl::flat_hash_map<const Body*, std::size_t> kinematics_;
  std::size_t fixed_ = 0;  // the place of what neither moves nor can be pushed
  std::vector<Contacts::Patch> patches_;
  std::vector<ContactPatch*> sources_;  // of the patches
  std::vector<Contacts::Motion> corrections_;
  std::vector<std::size_t> jointed_;
  std::vector<btVector3> linear_changes_;  // of jointed bodies since the start of the tick
  std::vector<btVector3> angular_changes_;
};

}  // namespace tessera::native
