#include "lpss/islands/step_solver.h"

#include <algorithm>
#include <cmath>

#include "lpss/base/bytes.h"

namespace tessera {
namespace {

// Two bodies that meet no faster do not bounce: without gravity, too, things come to rest.
constexpr double kBounceFromMin = 1e-4;  // m/s

constexpr double kOpenedShare = 0.06;  // of the smallest extent of those that can be pushed
constexpr double kOpenedMin = 0.001;   // m

}  // namespace

// In shorter steps, contacts are stiffer by their ratio. Each step also leaves a little of the speed at which
// it opens overlaps, which adds up: without less speed, bodies would be thrown.
template <typename Scalar>
Opening<Scalar>::Opening(double dt, int usual_steps, int steps)
    : stiffer_(Scalar(steps) / Scalar(usual_steps)) {
  constexpr double kStepAtFullSpeed = 1. / 240;  // s
  const double shorter = std::min(1., dt / usual_steps / kStepAtFullSpeed);
  in_steps_ = Scalar(shorter * std::sqrt(shorter));
}

// No faster, either, where the nimbleness of a body asks for more steps than usual, which make contacts
// stiffer by their ratio: one relaxed pass does not take such speeds from what turns so easily.
template <typename Scalar>
Scalar Opening<Scalar>::deepest_gap(Scalar extent, Scalar nimbleness) const {
  constexpr Scalar kOpenedAtFullSpeed = Scalar(0.2);  // m, with the usual steps
  const Scalar deepest = std::max(extent * Scalar(kOpenedShare), Scalar(kOpenedMin)) * in_steps_;
  if (!(nimbleness > 1 && stiffer_ > 1)) return -deepest;
  return -(std::min(deepest, kOpenedAtFullSpeed) / stiffer_);
}

template <typename Scalar>
StepSolver<Scalar>::StepSolver(const StepOptions& options)
    : options_(options), passes_(std::max(2, (options.iterations + options.steps - 1) / options.steps)) {}

template <typename Scalar>
void StepSolver<Scalar>::solve(Islands<Scalar>& islands, double dt, int steps, const ParallelFor& parallel) {
  const std::size_t contacts = islands.contacts.size();
  const int sweeps = begin(islands, dt, steps, std::span(&contacts, 1), /*bounces=*/false, parallel);
  for (int sweep = 0; sweep < sweeps; ++sweep) solve_stage(sweep, 0);
  // After the last step joints hold once more, whether anything bounces or not.
  if (may_bounce()) {
    for (int n = 0; n < kRebounds; ++n) rebound(n, 0);
  } else {
    joints_.hold();
  }
  end();
}

template <typename Scalar>
int StepSolver<Scalar>::begin(Islands<Scalar>& islands, double dt, int steps,
                              std::span<const std::size_t> stage_ends, bool bounces,
                              const ParallelFor& parallel) {
  steps_ = steps;
  stages_ = stage_ends.size();
  islands_ = &islands;
  parallel_ = &parallel;
  stage_ends_.clear();
  for (const std::size_t end : stage_ends) {
    const bool is_all = end == islands.contacts.size();
    stage_ends_.push_back(is_all ? islands.patches.size() : islands.contacts[end].first);
  }
  joints_.begin(islands, dt, steps);
  contacts_.begin({.time_step = Scalar(dt),
                   .steps = steps,
                   .usual_steps = options_.steps,
                   .bounce_from = Scalar(options_.bounce_from),
                   .bounce_from_min = Scalar(kBounceFromMin),
                   .parallel = parallel_},
                  islands.bodies, islands.patches, stage_ends_);
  joints_.begin(contacts_);
  return steps_ * passes_ + (bounces ? kRebounds : 0);
}

template <typename Scalar>
void StepSolver<Scalar>::solve_stage(int sweep, std::size_t stage) {
  const bool ends = stage + 1 == stages_;
  if (sweep >= steps_ * passes_) return rebound(sweep - steps_ * passes_, stage);
  const int pass = sweep % passes_;
  if (pass == 0 && stage == 0) {
    contacts_.start_step();
    joints_.start_step();
  }
  contacts_.pass(/*biased=*/!is_relaxed(sweep), stage);
  if (!ends) return;
  if (pass == 0 && passes_ > 2) return joints_.after_first_pass();
  joints_.after_pass(is_relaxed(sweep));
  if (pass == passes_ - 2) {
    contacts_.advance();
    joints_.advance();
  } else if (pass == passes_ - 1) {
    contacts_.end_step();
    joints_.end_step();
  }
}

template <typename Scalar>
void StepSolver<Scalar>::rebound(int sweep, std::size_t stage) {
  contacts_.rebound(stage);
  if (stage + 1 < stages_) return;
  joints_.rebound(sweep == 0);
}

template <typename Scalar>
void StepSolver<Scalar>::end() {
  contacts_.end(islands_->patches);
  run_in_pieces(*parallel_, islands_->dynamics, kBodiesInPiece, [this](std::size_t place) {
    const auto correction = contacts_.correction(place);
    const auto change = contacts_.change(place);
    auto& solved = islands_->solved[place];
    solved.linear = change.linear;
    solved.angular = change.angular;
    solved.way = correction.linear;
    solved.turn = correction.angular;
  });
  joints_.end();
  find_pushed();
  joints_.find_blamed(blamed_);
}

// In a relaxed sweep gaps move on by how the bodies advanced, too, and rebounds depend on how they met.
template <typename Scalar>
bool StepSolver<Scalar>::needs_advance(int sweep) const {
  return sweep % passes_ == passes_ - 1 || sweep >= steps_ * passes_;
}

template <typename Scalar>
std::size_t StepSolver<Scalar>::motion_size(int sweep) const {
  return (needs_advance(sweep) ? 12 : 6) * sizeof(Scalar);
}

template <typename Scalar>
void StepSolver<Scalar>::append_motion(int sweep, std::size_t body, std::string& bytes) const {
  const ByteWriter write(bytes);
  const auto append = [&](const RowBody<Scalar>& motion) {
    write(motion.linear);
    write(motion.angular);
  };
  append(contacts_.raw_motion(body));
  if (needs_advance(sweep)) append(contacts_.raw_advance(body));
}

template <typename Scalar>
bool StepSolver<Scalar>::set_motion(int sweep, std::size_t body, std::string_view bytes) {
  if (bytes.size() != motion_size(sweep)) return false;
  const ByteReader read(bytes);
  const auto next = [&] {
    RowBody<Scalar> motion = contacts_.raw_motion(body);
    read(motion.linear);
    read(motion.angular);
    return motion;
  };
  contacts_.set_raw_motion(body, next());
  if (needs_advance(sweep)) contacts_.set_raw_advance(body, next());
  return true;
}

// A body whose contacts would bounce, but bear nothing, is in free flight. Friction may stay where the last
// pass has taken the load that it came with.
template <typename Scalar>
void StepSolver<Scalar>::find_pushed() {
  const auto bears = [](const auto& patch) {
    if (!patch.friction_impulse.isZero(0) || patch.twist_impulse != 0) return true;
    if (patch.surface && !patch.surface->rolling_impulse.isZero(0)) return true;
    return std::any_of(patch.point, patch.point + patch.points,
                       [](const auto& point) { return point.impulse > 0; });
  };
  for (const auto& contact : islands_->contacts) {
    if (!contact.may_bounce) continue;  // its bodies are pushed anyway
    const auto patches = std::span(islands_->patches).subspan(contact.first, contact.patches);
    if (std::ranges::none_of(patches, bears)) continue;
    for (const std::size_t side : {patches.front().a, patches.front().b}) {
      if (side < islands_->dynamics) islands_->solved[side].is_pushed = true;
    }
  }
}

template class Opening<float>;
template class Opening<double>;
template class StepSolver<float>;
template class StepSolver<double>;

}  // namespace tessera
