// Solves islands in small steps: their contacts by lpss/solver/contact_solver.h, their joints by
// lpss/joints/joint_solver.h, in turns. A sweep is a pass of a step over all contacts; after those of all
// steps, kRebounds more let bodies bounce.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/functional/function_ref.h>

#include <deque>
#include <span>
#include <vector>

#include "lpss/joints/joint_solver.h"
#include "lpss/native/body.h"
#include "lpss/native/contact.h"
#include "lpss/native/contact_needs.h"
#include "lpss/native/jointed_contacts.h"
#include "lpss/native/task_parts.h"
#include "lpss/solver/contact_solver.h"

namespace tessera::native {

class NativeSolver final : public IslandSolver, public StagedSolver {
 public:
  NativeSolver(const EngineSettings& settings, const ContactNeeds& needs);

  void solve(const SolveTask& task, double dt, const ParallelFor& parallel) override;

  int begin(const SolveTask& task, double dt, const Stages& stages) override;
  void solve_stage(int sweep, std::size_t stage) override;
  void end() override;
  std::size_t motion_size(int sweep) const override;
  void append_motion(int sweep, std::size_t body, std::string& bytes) const override;
  void set_motion(int sweep, std::size_t body, std::string_view bytes) override;

 private:
  using Contacts = ContactSolver<Scalar>;

  int begin(const SolveTask& task, double dt, const Stages& stages, const ParallelFor& parallel);
  bool may_bounce() const { return contacts_.may_bounce() || jointed_contacts_.may_bounce(); }
  void rebound(int sweep, std::size_t stage);
  bool needs_advance(int sweep) const;
  bool is_relaxed(int sweep) const { return sweep < steps_ * passes_ && sweep % passes_ == passes_ - 1; }
  struct Source;
  void add_body(std::size_t place);
  void add_contacts(const Stages& stages);
  void look_at(const WorldPair& pair, Source& source) const;
  std::size_t place_of(const Body& body) const;
  std::size_t place_of_kinematic(const Body& body);
  void note_sides(Source& source);
  void fill_patches(const Source& source);
  void set_course(const Source& source, const ContactPatch& from, Contacts::Patch& patch,
                  Contacts::Course& course) const;
  void begin_joints();
  // The joints see what contacts have changed; with_joints() also tells contacts what `act` has.
  void show_joints();
  void with_joints(absl::FunctionRef<void()> act);
  bool is_as_set(std::size_t place) const;
  void find_corrections();
  void correct_jointed();
  void find_pushed();
  bool is_bounded(const Source& source) const;
  void write_impulses() const;
  void write_impulses(const Source& source) const;
  void write_bodies() const;
  void write_body(std::size_t place) const;

  // What contacts and joints do to a body.
  struct BodyNotes {
    bool is_pushed = false;   // by joints and contacts
    bool is_carried = false;  // by a surface that moves
    bool is_buried = false;   // in something
    bool is_as_set = false;   // nobody but joints had changed a velocity when these were last shown
  };

  // A contact of the task and the patches that it has there.
  struct Source {
    Contact* contact = nullptr;
    std::array<const Body*, 2> sides = {};
    std::array<std::size_t, 2> places = {};  // of the sides; kNoPlace until a kinematic one has one
    std::size_t first = 0;
    std::size_t first_surface = 0;
    std::size_t first_course = 0;
    const Body* carrier = nullptr;  // the side that has a course, if there is one
    bool is_deep = false;
    ContactScale scale;
  };

  const EngineSettings settings_;
  const ContactNeeds& needs_;
  const int passes_;  // of a step, biased and relaxed
  double dt_ = 0;     // s
  int steps_ = 0;
  Scalar opened_in_steps_ = 0;
  std::size_t stages_ = 0;
  // From begin() to end().
  const SolveTask* task_ = nullptr;
  const ParallelFor* parallel_ = nullptr;
  TaskParts parts_;
  Contacts contacts_;
  joints::JointSolver joints_;
  JointedContacts jointed_contacts_;
  std::vector<Body*> dynamics_;  // they come first
  std::vector<Contacts::Body> bodies_;
  std::vector<BodyNotes> notes_;  // by place
  absl::flat_hash_map<const Body*, std::size_t> kinematics_;
  std::size_t fixed_ = 0;  // the place of what neither moves nor can be pushed
  std::vector<Contacts::Patch> patches_;
  std::deque<Contacts::Surface> surfaces_;  // of patches, which refer to them
  std::vector<Contacts::Course> courses_;   // likewise
  std::vector<Source> sources_;
  std::vector<std::size_t> stage_ends_;  // in patches
  std::vector<Contacts::Motion> corrections_;
  std::vector<std::size_t> jointed_;
  std::vector<joints::JointedBody> jointed_bodies_;  // by place; those of others mean nothing
  std::vector<Vector> linear_changes_;               // of jointed bodies since the start of the tick
  std::vector<Vector> angular_changes_;
  std::vector<Contacts::Motion> told_changes_;  // those that contacts_ was last told ...
  std::vector<Contacts::Motion> set_changes_;   // ... as it has them ...
  std::vector<RowBody<Scalar>> set_motions_;    // ... and keeps them
};

}  // namespace tessera::native
