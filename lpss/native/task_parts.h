// Divides a task into parts with different numbers of substeps, according to the needs of the islands.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "lpss/base/disjoint_sets.h"
#include "lpss/engine/engine.h"
#include "lpss/joints/rotor.h"
#include "lpss/native/contact_needs.h"

namespace tessera::native {

// Islands, each whole, with their contacts and joints. Only dynamic bodies and clones of the task
// connect islands.
struct TaskPart {
  int steps = 1;                    // substeps of the tick, for each of its islands
  const SolveTask* task = nullptr;  // in the order of the whole task
};

class TaskParts {
 public:
  // Of a tick of `dt` seconds: at most one part for each number of steps. The bodies of the task and their
  // clones know their places in it (Body::place). Valid as long as the task, until the next call.
  std::span<const TaskPart> of(const SolveTask& task, const ContactNeeds& needs, double dt,
                               const ParallelFor& parallel);

 private:
  void connect(const SolveTask& task, const ParallelFor& parallel);
  void find_steps(const SolveTask& task, const ContactNeeds& needs, double dt);
  void ask(std::size_t body, int steps);
  void ask_for_turns(const SolveTask& task, const ContactNeeds& needs, double dt);
  void ask_for_loads(const SolveTask& task, const ContactNeeds& needs);
  void divide(const SolveTask& task);

  // The bodies of a contact, as far as it pushes them.
  struct Touch {
    std::size_t a = 0;  // Body::kNoPlace if it does not
    std::size_t b = 0;
    int substeps = 0;

    std::size_t pushed() const { return std::min(a, b); }
  };

  // What is left of a body's joints as the bodies that hang on only one of them are taken off.
  struct Hanging {
    int joints = 0;
    std::size_t all = 0;  // their places, by exclusive or: that of the last one
    double mass = 0;      // kg, with all that hangs on the body
  };

  // What the joints of a body say of how it turns.
  struct Turning {
    bool is_tied = false;
    joints::RotorSearch rotor;
    double carrier_moment = 0;  // kg m^2: the least one of what a rotor is held by
  };

  // Kept from call to call for their storage.
  DisjointSets islands_;
  std::vector<Touch> touches_;       // by contact
  std::vector<int> steps_;           // by the first body of each island
  std::vector<std::size_t> sizes_;   // likewise: its bodies
  std::vector<Turning> turning_;     // by body
  std::vector<Hanging> hanging_;     // likewise
  std::vector<std::size_t> ends_;    // bodies from which only one joint leads on
  std::vector<std::size_t> places_;  // of bodies in their parts
  std::vector<SolveTask> tasks_;
  std::vector<TaskPart> parts_;
};

}  // namespace tessera::native
