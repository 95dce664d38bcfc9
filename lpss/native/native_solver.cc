#include "lpss/native/native_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "lpss/base/bytes.h"
#include "lpss/base/columns.h"
#include "lpss/base/rotation.h"
#include "lpss/model/divergence.h"
#include "lpss/model/limits.h"
#include "lpss/native/carrier.h"
#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

// Two bodies that meet no faster do not bounce: without gravity, too, things come to rest.
constexpr Scalar kBounceFromMin = Scalar(1e-4);  // m/s

// Two free bodies that a sweep has found to meet have met at the end of the tick, as if they bounced at
// hardly any speed: in the next one, they may live in sectors that do not know each other.
constexpr Scalar kMetRestitution = Scalar(1e-6);

// Overlaps are opened as if they were no deeper, so that bodies that start inside each other come apart
// slowly.
constexpr Scalar kOpenedShare = Scalar(0.06);  // of the smallest extent of those that can be pushed
constexpr Scalar kOpenedMin = Scalar(0.001);   // m

// Deeper than any load presses a body in: it does not rest there, also where it does not get out.
constexpr Scalar kBuriedShare = Scalar(0.1);  // of the smallest extent of those that can be pushed

// What one thread does at a time.
constexpr std::size_t kBodiesInTaskPiece = 256;
constexpr std::size_t kContactsInPiece = 128;

// In shorter steps, contacts are stiffer by their ratio. Each step also leaves a little of the speed at which
// it opens overlaps, which adds up: without less speed, bodies would be thrown.
Scalar opened_in_steps(double usual_step) {
  constexpr double kStepAtFullSpeed = 1. / 240;  // s
  const double shorter = std::min(1., usual_step / kStepAtFullSpeed);
  return Scalar(shorter * std::sqrt(shorter));
}

Scalar deepest_opened(const ContactScale& scale, Scalar in_steps) {
  return std::max(Scalar(scale.extent) * kOpenedShare, kOpenedMin) * in_steps;
}

// Nor any faster where the nimbleness of a body asks for more steps than usual, which make contacts stiffer
// by their ratio: one relaxed pass does not take such speeds from what turns so easily.
Scalar deepest_opened(const ContactScale& scale, Scalar in_steps, Scalar stiffer) {
  constexpr Scalar kOpenedAtFullSpeed = Scalar(0.2);  // m, with the usual steps
  const Scalar deepest = deepest_opened(scale, in_steps);
  if (!(scale.nimbleness > 1 && stiffer > 1)) return deepest;
  return std::min(deepest, kOpenedAtFullSpeed) / stiffer;
}

// None for static bodies: they do not move, and a server that solves an island of others does not know where
// they are.
Columns<Scalar> to_lever(const Body& body) {
  return Columns<Scalar>(body.motion == Motion::kStatic ? Matrix(Matrix::Zero()) : body.pose.rotation);
}

Scalar deepest_gap(const Contact& contact) {
  Scalar gap = 0;
  for (const ContactPatch& patch : contact.patches) {
    for (int n = 0; n < patch.count; ++n) gap = std::min(gap, patch.point[n].gap);
  }
  return gap;
}

ContactSolver<Scalar>::Surface surface_of(const ContactSurface& contact, const ContactPatch& patch) {
  return {.direction = contact.direction,
          .along = contact.along,
          .across = contact.across,
          .drift = contact.velocity - contact.running.cross(patch.normal),
          .torsion = contact.torsion,
          .rolling = contact.rolling,
          .rolling_impulse = patch.rolling_impulse};
}

// Which worlds do when they are first asked for one: before several threads do.
void gather_contacts(const SolveTask& task) {
  const SectorWorld* gathered = nullptr;
  for (const WorldPair& contact : task.contacts) {
    if (contact.world != gathered) contact.world->contacts();
    gathered = contact.world;
  }
}

// Lets the bodies of a task and their clones know their places in it ...
void set_places(const SolveTask& task) {
  for (std::size_t n = 0; n < task.bodies.size(); ++n) body_of(task.bodies[n]).place = n;
  for (const SolveTask::CloneOf& clone : task.clones) body_of(clone.clone).place = clone.original;
}

// ... and forget them.
void clear_places(const SolveTask& task) {
  for (const WorldBody& body : task.bodies) body_of(body).place = Body::kNoPlace;
  for (const SolveTask::CloneOf& clone : task.clones) body_of(clone.clone).place = Body::kNoPlace;
}

}  // namespace

NativeSolver::NativeSolver(const EngineSettings& settings, const ContactNeeds& needs)
    : settings_(settings),
      needs_(needs),
      passes_(std::max(2, (settings.solver_iterations + settings.substeps - 1) / settings.substeps)) {}

void NativeSolver::solve(const SolveTask& task, double dt, const ParallelFor& parallel) {
  if (task.bodies.empty()) return;
  const auto solve_part = [&](const SolveTask& part, int steps) {
    const std::size_t contacts = part.contacts.size();
    const int sweeps = begin(part, dt, {std::span(&contacts, 1), steps, /*bounces=*/false}, parallel);
    for (int sweep = 0; sweep < sweeps; ++sweep) solve_stage(sweep, 0);
    // After the last step joints hold once more, whether anything bounces or not.
    if (may_bounce()) {
      for (int n = 0; n < kRebounds; ++n) rebound(n, 0);
    } else {
      with_joints([&] { joints_.pass(); });
    }
    end();
  };
  if (!needs_.adapts()) return solve_part(task, settings_.substeps);
  gather_contacts(task);
  set_places(task);
  const std::span<const TaskPart> parts = parts_.of(task, needs_, dt, parallel);
  clear_places(task);
  for (const TaskPart& part : parts) solve_part(*part.task, part.steps);
}

int NativeSolver::begin(const SolveTask& task, double dt, const Stages& stages) {
  static const ParallelFor kOneThread;
  return begin(task, dt, stages, kOneThread);
}

int NativeSolver::begin(const SolveTask& task, double dt, const Stages& stages, const ParallelFor& parallel) {
  dt_ = dt;
  steps_ = stages.substeps;
  opened_in_steps_ = opened_in_steps(dt / settings_.substeps);
  stages_ = stages.ends.size();
  task_ = &task;
  parallel_ = &parallel;
  set_places(task);
  kinematics_.clear();
  stage_ends_.clear();
  dynamics_.resize(task.bodies.size());
  bodies_.resize(task.bodies.size());
  run_in_pieces(parallel, task.bodies.size(), kBodiesInTaskPiece,
                [this](std::size_t place) { add_body(place); });
  fixed_ = bodies_.size();
  bodies_.emplace_back();
  notes_.assign(dynamics_.size(), {});
  add_contacts(stages);
  begin_joints();
  contacts_.begin({.time_step = Scalar(dt),
                   .steps = steps_,
                   .usual_steps = settings_.substeps,
                   .bounce_from = Scalar(settings_.bounce_from),
                   .bounce_from_min = kBounceFromMin,
                   .parallel = parallel_},
                  bodies_, patches_, stage_ends_);
  jointed_contacts_.clear();
  if (!joints_.is_empty()) jointed_contacts_.begin(contacts_, joints_, bodies_, jointed_, patches_);
  return steps_ * passes_ + (stages.bounces ? kRebounds : 0);
}

void NativeSolver::solve_stage(int sweep, std::size_t stage) {
  const bool ends = stage + 1 == stages_;
  if (sweep >= steps_ * passes_) return rebound(sweep - steps_ * passes_, stage);
  const int pass = sweep % passes_;
  if (pass == 0 && stage == 0) {
    contacts_.start_step();
    // What bodies on joints bear is known only once these have answered for it: at rest, a step then changes
    // nothing.
    with_joints([&] { joints_.start_step(); });
    jointed_contacts_.start_step();
    with_joints([&] { joints_.pass(); });
    jointed_contacts_.settle();
    with_joints([&] { joints_.pass_if_pushed(); });
  }
  contacts_.pass(/*biased=*/!is_relaxed(sweep), stage);
  if (!ends) return;
  // The contacts of jointed bodies have settled already, which was their first turn of the step.
  if (pass == 0 && passes_ > 2) return with_joints([&] { joints_.pass_untouched(); });
  if (is_relaxed(sweep)) {
    jointed_contacts_.relax();
  } else {
    jointed_contacts_.open();
  }
  with_joints([&] { joints_.pass(); });
  if (pass == passes_ - 2) {
    contacts_.advance();
    jointed_contacts_.note_velocities();
    if (!joints_.is_empty()) {
      show_joints();
      joints_.move();
    }
  } else if (pass == passes_ - 1) {
    contacts_.end_step();
    jointed_contacts_.note_velocities();
  }
}

void NativeSolver::rebound(int sweep, std::size_t stage) {
  contacts_.rebound(stage);
  if (stage + 1 < stages_) return;
  jointed_contacts_.rebound();
  if (sweep == 0) {
    with_joints([&] { joints_.pass(); });
  } else {
    with_joints([&] { joints_.pass_if_pushed(); });
  }
}

void NativeSolver::end() {
  contacts_.end(patches_);
  jointed_contacts_.end(patches_);
  find_corrections();
  find_pushed();
  write_impulses();
  write_bodies();
  clear_places(*task_);
}

// In a relaxed sweep gaps move on by how the bodies advanced, too, and rebounds depend on how they met.
bool NativeSolver::needs_advance(int sweep) const {
  return sweep % passes_ == passes_ - 1 || sweep >= steps_ * passes_;
}

std::size_t NativeSolver::motion_size(int sweep) const {
  return (needs_advance(sweep) ? 12 : 6) * sizeof(Scalar);
}

void NativeSolver::append_motion(int sweep, std::size_t body, std::string& bytes) const {
  const ByteWriter write(bytes);
  const auto append = [&](const RowBody<Scalar>& motion) {
    write(motion.linear);
    write(motion.angular);
  };
  append(contacts_.raw_motion(body));
  if (needs_advance(sweep)) append(contacts_.raw_advance(body));
}

void NativeSolver::set_motion(int sweep, std::size_t body, std::string_view bytes) {
  bullet::require(bytes.size() == motion_size(sweep),
                  "a motion must come from an engine of the same precision");
  const ByteReader read(bytes);
  const auto next = [&] {
    RowBody<Scalar> motion = contacts_.raw_motion(body);
    read(motion.linear);
    read(motion.angular);
    return motion;
  };
  contacts_.set_raw_motion(body, next());
  if (needs_advance(sweep)) contacts_.set_raw_advance(body, next());
}

void NativeSolver::add_body(std::size_t place) {
  Body& body = body_of(task_->bodies[place]);
  body.fine.reset();
  dynamics_[place] = &body;
  const auto dt = Scalar(dt_);
  bodies_[place] = {.linear = body.linear,
                    .angular = body.angular,
                    .linear_force = body.linear_push(dt),
                    .angular_force = body.angular_push(dt),
                    .inverse_mass = body.inverse_mass,
                    .inverse_inertia = body.inverse_inertia()};
}

// On several threads, but for what makes room: that is done contact by contact.
void NativeSolver::add_contacts(const Stages& stages) {
  const std::size_t count = stages.ends.empty() ? 0 : stages.ends.back();
  gather_contacts(*task_);
  sources_.resize(count);
  run_in_pieces(*parallel_, count, kContactsInPiece,
                [this](std::size_t n) { look_at(task_->contacts[n], sources_[n]); });
  surfaces_.clear();
  courses_.clear();
  std::size_t patches = 0;
  std::size_t next = 0;
  for (const std::size_t end : stages.ends) {
    for (; next < end; ++next) {
      sources_[next].first = patches;
      patches += sources_[next].contact->patches.size();
      note_sides(sources_[next]);
    }
    stage_ends_.push_back(patches);
  }
  patches_.resize(patches);
  run_in_pieces(*parallel_, count, kContactsInPiece, [this](std::size_t n) { fill_patches(sources_[n]); });
}

// Where the body is in the task; kNoPlace for kinematic ones.
std::size_t NativeSolver::place_of(const Body& body) const {
  if (body.is_dynamic()) return body.place != Body::kNoPlace ? body.place : fixed_;
  return body.motion == Motion::kStatic ? fixed_ : Body::kNoPlace;
}

std::size_t NativeSolver::place_of_kinematic(const Body& body) {
  const auto [known, is_new] = kinematics_.try_emplace(&body, bodies_.size());
  if (is_new) bodies_.push_back({.linear = body.linear, .angular = body.angular});
  return known->second;
}

void NativeSolver::look_at(const WorldPair& place, Source& source) const {
  auto& world = static_cast<NativeWorld&>(*place.world);
  const ContactPair& pair = world.contacts()[place.pair];
  source.contact = &world.contact(place.pair);
  source.sides = {&world.body(pair.slot_a), &world.body(pair.slot_b)};
  for (std::size_t side = 0; side < 2; ++side) source.places[side] = place_of(*source.sides[side]);
  source.carrier = nullptr;
  for (const Body* side : source.sides) {
    if (has_course(*side)) source.carrier = side;
  }
  source.scale = scale_of(*source.sides[0], *source.sides[1]);
  source.is_deep = deepest_gap(*source.contact) < -Scalar(source.scale.extent) * kBuriedShare;
}

// Makes room for what its patches refer to, and notes what the contact does to its bodies.
void NativeSolver::note_sides(Source& source) {
  for (std::size_t side = 0; side < 2; ++side) {
    std::size_t& place = source.places[side];
    if (place == Body::kNoPlace) place = place_of_kinematic(*source.sides[side]);
  }
  const Contact& contact = *source.contact;
  if (contact.has_surfaces()) {
    source.first_surface = surfaces_.size();
    surfaces_.resize(surfaces_.size() + contact.patches.size());
  }
  if (source.carrier) {
    source.first_course = courses_.size();
    courses_.resize(courses_.size() + contact.patches.size());
  }
  const bool carries = contact.surface && contact.surface->moves();
  for (const std::size_t side : source.places) {
    if (side >= notes_.size()) continue;
    BodyNotes& notes = notes_[side];
    if (carries) notes.is_carried = true;
    if (source.is_deep) notes.is_buried = true;
    // Near what they do not bounce on, bodies fall by what a step of the solver makes of it, which damps
    // rattling.
    if (contact.restitution <= 0) notes.is_pushed = true;
  }
}

void NativeSolver::fill_patches(const Source& source) {
  const Contact& contact = *source.contact;
  const Body& a = *source.sides[0];
  const Body& b = *source.sides[1];
  const Scalar stiffer = Scalar(steps_) / Scalar(settings_.substeps);
  const Scalar gap_min = -deepest_opened(source.scale, opened_in_steps_, stiffer);
  const Columns<Scalar> to_lever_a = to_lever(a);
  const Columns<Scalar> to_lever_b = to_lever(b);
  for (std::size_t p = 0; p < contact.patches.size(); ++p) {
    const ContactPatch& from = contact.patches[p];
    Contacts::Patch& patch = patches_[source.first + p];
    patch.a = source.places[0];
    patch.b = source.places[1];
    const ContactMaterial* const own = contact.material_of(p);
    patch.friction = own ? own->friction : contact.friction;
    const Scalar restitution = own ? own->restitution : contact.restitution;
    const bool meets = from.is_predicted && a.is_dynamic() && b.is_dynamic();
    patch.restitution = meets ? std::max(restitution, kMetRestitution) : restitution;
    patch.is_jointed = false;  // until begin_joints()
    patch.points = from.count;
    patch.friction_impulse = from.friction_impulse;
    patch.twist_impulse = from.twist_impulse;
    const ContactSurface* const surface = contact.surface_of(p);
    patch.surface = surface ? &surfaces_[source.first_surface + p] : nullptr;
    if (surface) *patch.surface = surface_of(*surface, from);
    for (std::size_t n = 0; n < patch.points; ++n) {
      const ContactPoint& point = from.point[n];
      Contacts::Point& into = patch.point[n];
      into.lever_a = to_lever_a * point.on_a;
      into.lever_b = to_lever_b * point.on_b;
      into.normal = from.normal;
      into.gap = std::max(point.gap, gap_min);
      into.impulse = point.impulse;
    }
    patch.course = nullptr;
    if (source.carrier) set_course(source, from, patch, courses_[source.first_course + p]);
  }
}

void NativeSolver::set_course(const Source& source, const ContactPatch& from, Contacts::Patch& patch,
                              Contacts::Course& course) const {
  const Body& carrier = *source.carrier;
  const bool is_a = &carrier == source.sides[0];
  const Body& rider = *source.sides[is_a ? 1 : 0];
  Vector lever = Vector::Zero();
  Vector arm = rider.pose.position - carrier.pose.position;
  for (std::size_t n = 0; n < patch.points; ++n) {
    const Contacts::Point& point = patch.point[n];
    lever += (is_a ? point.lever_a : point.lever_b) / Scalar(patch.points);
    arm += (is_a ? point.lever_b : point.lever_a) / Scalar(patch.points);
  }
  const bool is_ridden = rides_on(carrier, rider);
  course = course_at(carrier, arm, lever, is_ridden, dt_);
  if (!is_a) {
    for (Vector* part : {&course.linear, &course.angular, &course.linear_change, &course.angular_change})
      *part = -*part;
  }
  patch.course = &course;
  if (is_ridden) patch.friction_impulse = turned_with(carrier, from.friction_impulse, dt_);
}

void NativeSolver::find_corrections() {
  corrections_.resize(dynamics_.size());
  run_in_pieces(*parallel_, dynamics_.size(), kBodiesInTaskPiece,
                [this](std::size_t place) { corrections_[place] = contacts_.correction(place); });
  if (!joints_.is_empty()) correct_jointed();
}

// A body whose contacts would bounce, but bear nothing, is in free flight.
void NativeSolver::find_pushed() {
  // Friction may stay where the last pass has taken the load that it came with.
  const auto bears = [](const Contacts::Patch& patch) {
    if (!patch.friction_impulse.isZero(0) || patch.twist_impulse != 0) return true;
    if (patch.surface && !patch.surface->rolling_impulse.isZero(0)) return true;
    return std::any_of(patch.point, patch.point + patch.points,
                       [](const Contacts::Point& point) { return point.impulse > 0; });
  };
  for (const Source& source : sources_) {
    if (source.contact->restitution <= 0) continue;  // its bodies are pushed anyway
    const std::span patches = std::span(patches_).subspan(source.first, source.contact->patches.size());
    if (std::ranges::none_of(patches, bears)) continue;
    for (const std::size_t side : source.places) {
      if (side < notes_.size()) notes_[side].is_pushed = true;
    }
  }
}

// Of impulses that the next tick may start from: none is larger than it takes to stop the heaviest body at
// the highest speed. What they are follows from the contact alone, whoever solves it.
bool NativeSolver::is_bounded(const Source& source) const {
  constexpr double kMost = kMassMax * kSpeedMax;  // N s
  const auto within = [](double impulse) { return std::abs(impulse) <= kMost; };
  const std::size_t end = source.first + source.contact->patches.size();
  for (std::size_t p = source.first; p < end; ++p) {
    const Contacts::Patch& patch = patches_[p];
    if (!within(patch.friction_impulse.cast<double>().norm()) || !within(patch.twist_impulse)) return false;
    if (patch.surface && !within(patch.surface->rolling_impulse.cast<double>().norm())) return false;
    for (std::size_t n = 0; n < patch.points; ++n) {
      if (!within(patch.point[n].impulse)) return false;
    }
  }
  return true;
}

void NativeSolver::write_impulses() const {
  run_in_pieces(*parallel_, sources_.size(), kContactsInPiece,
                [this](std::size_t n) { write_impulses(sources_[n]); });
}

void NativeSolver::write_impulses(const Source& source) const {
  if (!is_bounded(source)) return drop_impulses(*source.contact);
  // Patches that press against each other bear nothing.
  Eigen::Vector3d load = Eigen::Vector3d::Zero();
  ContactScale scale = source.scale;
  double mobility = 0;
  const Scalar gap_min = -deepest_opened(source.scale, opened_in_steps_);
  std::size_t p = source.first;
  for (ContactPatch& into : source.contact->patches) {
    const Contacts::Patch& patch = patches_[p++];
    into.friction_impulse = patch.friction_impulse;
    into.twist_impulse = patch.twist_impulse;
    if (patch.surface) into.rolling_impulse = patch.surface->rolling_impulse;
    double borne = 0;
    for (std::size_t n = 0; n < patch.points; ++n) {
      into.point[n].impulse = patch.point[n].impulse;
      // What opens a deep overlap bears nothing; but contacts of joints know what they bear.
      if (patch.is_jointed || into.point[n].gap > gap_min) borne += double(patch.point[n].impulse);
    }
    load += borne * into.normal.cast<double>();
    if (patch.is_jointed) mobility = std::max(mobility, patch.mobility);
  }
  // A foot bears as easily as the robot that it belongs to.
  if (mobility > 0) scale.inverse_mass = mobility;
  needs_.note(source.contact->need, load.norm(), scale);
}

void NativeSolver::write_bodies() const {
  run_in_pieces(*parallel_, dynamics_.size(), kBodiesInTaskPiece,
                [&](std::size_t place) { write_body(place); });
}

// The body then moves on by the velocities that it ends with: what is corrected here is all but that. One
// that would be corrected to nowhere, or farther than any body goes, stays, and has diverged: its velocities
// say why.
void NativeSolver::write_body(std::size_t place) const {
  Body& body = *dynamics_[place];
  const double corrected_max = kSpeedMax * dt_;
  if (!(corrections_[place].linear.cast<double>().squaredNorm() <= corrected_max * corrected_max) ||
      !corrections_[place].angular.allFinite()) {
    const Vector gains = velocity_of_gained_energy().cast<Scalar>();
    constexpr Scalar kNone = std::numeric_limits<Scalar>::quiet_NaN();
    body.linear = corrections_[place].linear == gains ? gains : Vector::Constant(kNone);
    body.angular = body.linear;
    return;
  }
  const BodyNotes& notes = notes_[place];
  if (notes.is_pushed) {
    const Contacts::Motion change = contacts_.change(place);
    body.linear += change.linear;
    body.angular += change.angular;
  } else {
    body.coast(Scalar(dt_));
  }
  // What is still being pushed out of an overlap does not rest, however slow it is; nor does what is deep in
  // one, or what a moving surface carries.
  const Scalar pushed_max = body.still_limits.linear * Scalar(dt_);
  const bool is_corrected = corrections_[place].linear.squaredNorm() > pushed_max * pushed_max;
  if (is_corrected || notes.is_buried || notes.is_carried) body.still_for = 0;
  body.pose.position += corrections_[place].linear;
  body.pose.rotation = turned(body.pose.rotation, corrections_[place].angular);
}

}  // namespace tessera::native
