// Joints, and the contacts of what they hold, take turns with a solver of contacts.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "lpss/islands/islands.h"
#include "lpss/islands/jointed_contacts.h"
#include "lpss/joints/joint_solver.h"
#include "lpss/solver/contact_solver.h"

namespace tessera {

// For the joints of one set of islands at a time; without any, nothing happens in any call.
template <typename Scalar>
class JointTurns final : private FreeBodies {
 public:
  using Contacts = ContactSolver<Scalar>;

  // For a tick of `dt` seconds in so many steps. Tells patches which of them are jointed; to be called before
  // begin() of the contacts ...
  void begin(Islands<Scalar>& islands, double dt, int steps);
  // ... and after it.
  void begin(Contacts& contacts);

  bool is_empty() const { return joints_.is_empty(); }
  bool may_bounce() const { return jointed_contacts_.may_bounce(); }

  // Turns: at the start of a step, after its first pass over contacts, after others, and after a rebound.
  void start_step();
  void after_first_pass();
  void after_pass(bool relaxed);
  void hold();  // joints alone
  void rebound(bool is_first);
  // Bodies move by the velocities that they have now.
  void advance();
  void end_step();

  // Writes what the islands have of jointed bodies and their patches. The contacts have ended.
  void end();

  // Once all is solved.
  void find_blamed(std::vector<BlamedJoint>& blamed) const;

 private:
  using Vector = typename Islands<Scalar>::Vector;

  Velocities change(std::size_t place) const override;
  void push(std::size_t place, const Velocities& change) override;

  JointSide side_of(std::size_t place) const;
  joints::SolvedJoint solved_joint(const IslandJoint& joint) const;
  void begin_jointed_contacts();
  void write_impulses();
  void write_loads();
  bool has_diverged(std::size_t place) const;
  Pose pose_after(std::size_t place) const;
  double error_of(const IslandJoint& joint) const;

  double dt_ = 0;  // s
  Islands<Scalar>* islands_ = nullptr;
  Contacts* contacts_ = nullptr;
  joints::JointSolver joints_;
  JointedContacts jointed_contacts_;
  std::vector<std::size_t> jointed_;  // places of bodies, ascending
  // By place; those of others mean nothing.
  std::vector<joints::JointedBody> bodies_;
  std::vector<SolverTypes<double>::Body> touched_;
  // Jointed patches in double precision, and what they refer to.
  std::vector<JointedContacts::Given> patches_;
  std::vector<SolverTypes<double>::Surface> surfaces_;
  std::vector<SolverTypes<double>::Course> courses_;
};

extern template class JointTurns<float>;
extern template class JointTurns<double>;

}  // namespace tessera
