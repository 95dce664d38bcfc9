// The arrays of the islands of a task: gathered from the worlds where its bodies live and its contacts were
// found, or from what was shipped; and put back there.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <array>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/islands/step_solver.h"
#include "lpss/native/numbers.h"

namespace tessera::native {

// Keeps its storage from task to task.
class TaskArrays {
 public:
  TaskArrays(const EngineSettings& settings, const ContactNeeds& needs)
      : settings_(settings),
        needs_(needs),
        usual_(settings.time_step, settings.substeps, settings.substeps) {}

  // Islands of a task (their places in it, ascending), for a tick of `dt` seconds in so many steps. The task
  // and its worlds stay as they are until what comes of it is put back.
  void gather(const SolveTask& task, std::span<const std::size_t> islands, double dt, int steps,
              const ParallelFor& parallel);

  // The joints of the whole task and, if there are any, its bodies.
  void gather_joints(const SolveTask& task, double dt, const ParallelFor& parallel);

  Islands<Scalar>& islands() { return islands_; }
  std::size_t body_in_task(std::size_t place) const { return bodies_[place]; }
  std::size_t joint_in_task(std::size_t place) const { return joints_[place]; }

  // What the islands have become: into their worlds; and what becomes of what was shipped, if that is to be
  // told, into `solved`, in which there is room for it.
  void put_back(SolvedTask* solved, const ParallelFor& parallel) const;
  static void make_room(const SolveTask& task, SolvedTask& solved);

 private:
  // A contact of the task, and where it is in the arrays.
  struct Source {
    const WorldPair* pair = nullptr;
    std::size_t shift = 0;  // of places, from the task's to the arrays', modulo the range of numbers
    ContactHead head;
    Contact* contact = nullptr;  // none: shipped
    std::array<const Body*, 2> bodies = {};
    std::string_view shipped;  // its patches
    std::array<std::size_t, 2> places = {};
    std::size_t first_surface = 0;
    std::size_t first_course = 0;

    ContactView view() const { return {contact, bodies[0], bodies[1]}; }
  };

  void choose(std::span<const std::size_t> islands);
  void gather_bodies(const ParallelFor& parallel);
  void gather_body(std::size_t place);
  void gather_contacts(int steps, const ParallelFor& parallel);
  void look_at(Source& source) const;
  std::size_t place_of(const Source& source, std::size_t side);
  void make_room(Source& source);
  void fill_patches(const Source& source, std::size_t first, Scalar gap_min);
  void find_flying(std::span<const std::size_t> islands, int steps);
  void put_back_body(std::size_t place, SolvedTask* solved) const;
  void put_back_pair(std::size_t n, SolvedTask* solved) const;

  const EngineSettings& settings_;
  const ContactNeeds& needs_;
  const Opening<Scalar> usual_;  // of usual steps
  const SolveTask* task_ = nullptr;
  double dt_ = 0;  // s
  Islands<Scalar> islands_;
  std::vector<std::size_t> bodies_;  // by place: that in the task
  std::vector<std::size_t> joints_;  // likewise
  std::vector<Source> sources_;      // of islands_.contacts
  absl::flat_hash_map<const Body*, std::size_t> kinematics_;
};

}  // namespace tessera::native
