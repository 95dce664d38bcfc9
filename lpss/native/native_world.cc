#include "lpss/native/native_world.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "lpss/native/bouncing_balls.h"
#include "lpss/native/combine.h"
#include "lpss/native/deep_overlap.h"
#include "lpss/native/numbers.h"

namespace tessera::native {
namespace {

// Of loops over threads: enough to be worth a piece.
constexpr std::size_t kBodiesInWorldPiece = 128;
constexpr std::size_t kCandidatesInPiece = 256;
// Of jointed bodies that hit something at speed, times the usual.
constexpr int kSubstepsOfHit = 4;
// Of the thickness of what is hit: how far it takes to be at speed.
constexpr Scalar kHitShare = Scalar(0.5);

// The weight of the heavier body by that of the lighter one, in the direction of the contact's normal; 0
// where the lighter one does not carry it, or that is a light load.
double rests_on(const Body& a, const Body& b, const Contact& contact) {
  if (!(a.inverse_mass > 0 && b.inverse_mass > 0)) return 0;
  const Body& heavier = a.inverse_mass < b.inverse_mass ? a : b;
  const Body& lighter = a.inverse_mass < b.inverse_mass ? b : a;
  const double ratio = double(lighter.inverse_mass) / double(heavier.inverse_mass);
  if (ratio <= ContactNeeds::kLightLoad) return 0;
  const Vector& normal = contact.patches.front().normal;
  const Scalar down = heavier.gravity.dot(&heavier == &a ? -normal : normal);
  if (!(down > 0)) return 0;
  return double(down / heavier.gravity.norm()) * double(lighter.inverse_mass) / double(heavier.inverse_mass);
}

}  // namespace

NativeWorld::NativeWorld(NativeEngine& engine) : engine_(engine), settings_(engine.settings()) {}

BodySlot NativeWorld::add(const BodyRecord& record, Role role) {
  return add(record, role, engine_.form_of(record.properties));
}

BodySlot NativeWorld::add_static(BodyId id, const BodyProperties& properties, const Shape& part,
                                 const Pose& pose) {
  BodyRecord record{id, {}, properties, {}};
  record.properties.motion = Motion::kStatic;
  record.state.position = {pose.position.x(), pose.position.y(), pose.position.z()};
  record.state.rotation = rotation_of(pose.orientation);
  record.state.activity = Activity::kAsleep;
  return add(record, Role::kStatic, std::make_shared<const BodyForm>(part, Pose{}, /*is_static=*/true));
}

BodySlot NativeWorld::add(const BodyRecord& record, Role role, const std::shared_ptr<const BodyForm>& form) {
  const BodySlot slot = add(Body(record, role, BodyForm::solid_of(form), settings_));
  add_sensor(slot, form, record.properties.trigger);
  if (record.properties.motion == Motion::kKinematic) kinematics_.push_back(slot);
  return slot;
}

BodySlot NativeWorld::add(Body added) {
  require(added.id.value > 0 && added.id.value <= kBodyIdMax, "a body's id must be 1 to kBodyIdMax");
  BodySlot slot = static_cast<BodySlot>(bodies_.size());
  const bool is_new = slots_.try_emplace(added.id, 0).second;
  require(is_new, "a body may be in a world once");
  if (free_slots_.empty()) {
    bodies_.push_back(std::move(added));
  } else {
    slot = free_slots_.back();
    free_slots_.pop_back();
    body(slot) = std::move(added);
  }
  Body& body = this->body(slot);
  slots_[body.id] = slot;
  body.bounds = body.bounds_at(body.pose);
  note_home(body, homes_);
  broad_phase_.add(body, slot);
  return slot;
}

void NativeWorld::remove(BodySlot slot) {
  broad_phase_.remove(body(slot));
  slots_.erase(body(slot).id);
  if (body(slot).sensor) std::erase(sensors_, slot);
  if (body(slot).motion == Motion::kKinematic) std::erase(kinematics_, slot);
  removed_.push_back(slot);
  is_gathered_ = false;
}

void NativeWorld::forget_removed() {
  if (removed_.empty()) return;
  std::erase_if(candidates_, [&](Candidate& candidate) {
    if (is_there(candidate.slot_a) && is_there(candidate.slot_b)) return false;
    drop_contact(candidate);
    return true;
  });
  for (const BodySlot slot : removed_) body(slot).solid.reset();
  free_slots_.insert(free_slots_.end(), removed_.begin(), removed_.end());
  removed_.clear();
}

std::optional<BodySlot> NativeWorld::slot_of(BodyId id) const {
  const auto slot = slots_.find(id);
  if (slot == slots_.end()) return std::nullopt;
  return slot->second;
}

Eigen::Vector3d NativeWorld::position(BodySlot slot) const {
  const Body& b = body(slot);
  if (b.motion == Motion::kStatic) return Eigen::Map<const Eigen::Vector3d>(b.static_state->position.data());
  return b.fine ? b.fine->position : b.pose.position.cast<double>();
}

Eigen::Vector3d NativeWorld::linear_velocity(BodySlot slot) const {
  const Body& b = body(slot);
  return b.fine ? b.fine->velocity : b.linear.cast<double>();
}

void NativeWorld::set_velocity(BodySlot slot, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) {
  Body& changed = body(slot);
  changed.fine.reset();
  changed.linear = linear.cast<Scalar>();
  changed.angular = angular.cast<Scalar>();
  note_home(changed, homes_);
}

void NativeWorld::apply_impulse(BodySlot slot, const Eigen::Vector3d& impulse, const Eigen::Vector3d& lever) {
  Body& pushed = body(slot);
  pushed.fine.reset();
  pushed.linear += impulse.cast<Scalar>() * pushed.inverse_mass;
  pushed.angular += pushed.inverse_inertia() * lever.cast<Scalar>().cross(impulse.cast<Scalar>());
  note_home(pushed, homes_);
}

void NativeWorld::set_surface(BodySlot slot, const Surface& surface) { body(slot).set_surface(surface); }

void NativeWorld::add_wrench(BodySlot slot, const Wrench& wrench) {
  Body& pushed = body(slot);
  pushed.force += vector(wrench.force);
  pushed.torque += vector(wrench.torque);
  const Scalar surge = pushed.surge + pushed.surge_of(wrench, Scalar(settings_.time_step));
  pushed.surge = std::min(surge, Scalar(kSurgeMax));
  note_home(pushed, homes_);
}

void NativeWorld::set_surge(BodySlot slot, double surge) {
  body(slot).surge = Scalar(surge);
  note_home(body(slot), homes_);
}

void NativeWorld::set_jointed(BodySlot slot, bool jointed) {
  body(slot).jointed = jointed;
  note_home(body(slot), homes_);
}

void NativeWorld::set_gravity(BodySlot slot, const Eigen::Vector3d& acceleration) {
  Body& pulled = body(slot);
  if (!pulled.feels_gravity) return;
  pulled.gravity = acceleration.cast<Scalar>();
  pulled.exact_gravity = acceleration;
}

void NativeWorld::set_mass(BodySlot slot, double mass, const std::array<double, 3>& moments) {
  Body& loaded = body(slot);
  loaded.set_mass(mass, moments);
  note_home(loaded, homes_);
}

void NativeWorld::set_turning(BodySlot slot, const FrameTurn& turning) {
  body(slot).turning = std::make_unique<const FrameTurn>(turning);
}

void NativeWorld::set_state(BodySlot slot, const BodyState& state) {
  body(slot).set_state(state);
  set_bounds_to_pose(slot);
}

void NativeWorld::set_bounds_to_pose(BodySlot slot) const {
  Body& boxed = bodies_[static_cast<std::size_t>(slot)];
  if (!set_bounds(boxed)) return;
  note_home(boxed, homes_);
  broad_phase_.update(boxed, slot, Scalar(settings_.time_step));
}

// To its pose. False for a body without a sensible box, which keeps its last one.
bool NativeWorld::set_bounds(Body& body) const {
  const Bounds bounds = body.bounds_at(body.pose);
  if (body.motion != Motion::kStatic && !is_sensible(bounds)) return false;
  body.bounds = bounds;
  return true;
}

void NativeWorld::sleep(BodySlot slot) {
  Body& sleeper = body(slot);
  if (sleeper.motion == Motion::kStatic) return;
  sleeper.fine.reset();
  sleeper.linear.setZero();
  sleeper.angular.setZero();
  sleeper.linear_before.setZero();
  sleeper.angular_before.setZero();
  sleeper.activity = Activity::kAsleep;
  set_bounds_to_pose(slot);
}

void NativeWorld::wake(BodySlot slot) {
  if (body(slot).motion == Motion::kStatic) return;
  body(slot).activity = Activity::kAwake;
  body(slot).still_for = 0;
  note_home(body(slot), homes_);
}

void NativeWorld::rest() {
  bodies_.shrink_to_fit();
  candidates_.shrink_to_fit();
  contacts_.shrink_to_fit();
  free_contacts_.shrink_to_fit();
  pairs_.shrink_to_fit();
  contact_of_pair_.shrink_to_fit();
  pairs_of_body_ = {};
  bodies_pieces_ = {};
  candidates_pieces_ = {};
  fixed_ = {};
  fixed_of_body_ = {};
  flush_pieces_ = {};
  meetings_pieces_ = {};
  noted_ = {};
  broad_phase_.rest();
}

Wrench NativeWorld::total_wrench(BodySlot slot) const {
  return {array(body(slot).force), array(body(slot).torque)};
}

void NativeWorld::set_total_wrench(BodySlot slot, const Wrench& wrench) {
  body(slot).force = vector(wrench.force);
  body(slot).torque = vector(wrench.torque);
}

bool NativeWorld::is_wanted(const Body& a, const Body& b) const {
  return is_wanted_pair(a, b) && !is_found_elsewhere(a, b) && !engine_.are_apart(a.id, b.id);
}

void NativeWorld::detect(double dt, const ParallelFor& parallel) {
  forget_removed();
  predict(Scalar(dt), parallel);
  broad_phase_.find_pairs(bodies_, candidates_, is_wanted_pair, parallel);
  update_contacts(parallel);
  join_flush(parallel);
  predict_meetings(noted(&BodiesPiece::foreseen, pieces_of_bodies()), parallel);
  predict_contacts(noted(&BodiesPiece::fast, pieces_of_bodies()), parallel);
  gather(parallel);
}

Pieces NativeWorld::pieces_of_bodies() const {
  const Pieces pieces(bodies_.size(), kBodiesInWorldPiece);
  if (bodies_pieces_.size() < pieces.count()) bodies_pieces_.resize(pieces.count());
  return pieces;
}

Pieces NativeWorld::pieces_of_candidates() {
  const Pieces pieces(candidates_.size(), kCandidatesInPiece);
  if (candidates_pieces_.size() < pieces.count()) candidates_pieces_.resize(pieces.count());
  return pieces;
}

// The bodies that the pieces have noted, in the order of slots.
std::span<BodySlot> NativeWorld::noted(std::vector<BodySlot> BodiesPiece::*list, const Pieces& pieces) {
  noted_.clear();
  for (const BodiesPiece& piece : std::span(bodies_pieces_).first(pieces.count())) {
    const std::vector<BodySlot>& some = piece.*list;
    noted_.insert(noted_.end(), some.begin(), some.end());
  }
  return noted_;
}

// Forces, damping and boxes.
void NativeWorld::predict(Scalar dt, const ParallelFor& parallel) {
  const Pieces pieces = pieces_of_bodies();
  run_parallel(parallel, pieces.count(), [&](std::size_t n) {
    BodiesPiece& piece = bodies_pieces_[n];
    piece.left.clear();
    piece.fast.clear();
    piece.foreseen.clear();
    for (std::size_t place = pieces.begin(n); place < pieces.end(n); ++place) {
      Body& body = bodies_[place];
      const auto slot = static_cast<BodySlot>(place);
      body.is_foreseen = false;
      if (!body.leaf || !body.is_awake()) continue;
      predict(body, dt);
      body.is_foreseen = is_foreseen(body, dt);
      if (!update_bounds(body, dt)) {
        body.is_foreseen = false;
        continue;
      }
      if (!body.enlarged.contains(body.bounds)) piece.left.push_back(slot);
      if (body.is_foreseen) piece.foreseen.push_back(slot);
      if (!(body.is_foreseen && body.jointed) && is_swept(body)) piece.fast.push_back(slot);
    }
  });
  for (const BodySlot slot : noted(&BodiesPiece::left, pieces)) broad_phase_.update(body(slot), slot, dt);
  bounds_are_old_ = true;
}

// Clones are damped, too, since they are swept like their originals.
void NativeWorld::predict(Body& body, Scalar dt) const {
  if (!body.is_dynamic()) return;
  body.flies = false;
  if (body.role == Role::kHome) {
    body.force += body.pull() / body.inverse_mass;
    if (body.turning) body.torque += body.turning->torque.cast<Scalar>();
  }
  body.linear *= body.linear_damping;
  body.angular *= body.angular_damping;
  body.next.position = body.pose.position + body.linear * dt;
}

// Boxes follow from poses, and hold the way of a fast body. False for a body that is nowhere, or is too
// large: it sleeps, and keeps its last box.
bool NativeWorld::update_bounds(Body& body, Scalar dt) const {
  Bounds bounds = bounds_are_old_ ? body.bounds_at(body.pose) : body.bounds;
  if (body.is_foreseen) {
    bounds = swept(body, bounds, dt);
  } else if (settings_.continuous_collision && body.is_dynamic()) {
    bounds.extend(bounds.moved(body.linear * dt));
  }
  if (!body.pose.is_somewhere() || !is_sensible(bounds)) {
    if (body.is_dynamic()) body.activity = Activity::kAsleep;
    return false;
  }
  body.bounds = bounds;
  return true;
}

void NativeWorld::update_contacts(const ParallelFor& parallel) {
  const Pieces pieces = pieces_of_candidates();
  run_parallel(parallel, pieces.count(), [&](std::size_t piece) {
    update_contacts(pieces.begin(piece), pieces.end(piece), candidates_pieces_[piece]);
  });
  std::size_t kept = 0;
  fixed_.clear();
  for (std::size_t n = 0; n < pieces.count(); ++n) {
    CandidatesPiece& piece = candidates_pieces_[n];
    for (FixedCandidate fixed : piece.fixed) {
      fixed.candidate += kept;
      fixed_.push_back(fixed);
    }
    free_contacts_.insert(free_contacts_.end(), piece.dropped.begin(), piece.dropped.end());
    for (auto& [candidate, contact] : piece.made)
      candidates_[candidate].contact = keep_contact(std::move(contact));
    if (kept != pieces.begin(n)) {
      std::copy_n(candidates_.begin() + static_cast<std::ptrdiff_t>(pieces.begin(n)), piece.kept,
                  candidates_.begin() + static_cast<std::ptrdiff_t>(kept));
    }
    kept += piece.kept;
  }
  candidates_.resize(kept);
}

void NativeWorld::update_contacts(std::size_t begin, std::size_t end, CandidatesPiece& piece) {
  piece.dropped.clear();
  piece.made.clear();
  piece.fixed.clear();
  std::size_t next = begin;
  const auto drop = [&](Candidate& candidate) {
    if (candidate.contact == Candidate::kNone) return;
    piece.dropped.push_back(candidate.contact);
    candidate.contact = Candidate::kNone;
  };
  const auto note_fixed = [&](const Candidate& candidate, const Body& a, const Body& b) {
    if (a.is_dynamic() && b.is_dynamic()) return;
    piece.fixed.push_back(b.is_dynamic() ? FixedCandidate{candidate.slot_b, candidate.slot_a, next - begin}
                                         : FixedCandidate{candidate.slot_a, candidate.slot_b, next - begin});
  };
  for (std::size_t n = begin; n < end; ++n) {
    Candidate& candidate = candidates_[n];
    const Body& a = body(candidate.slot_a);
    const Body& b = body(candidate.slot_b);
    const bool is_asleep = !a.is_awake() && !b.is_awake();
    const bool is_near = a.bounds.overlaps(b.bounds);
    const bool is_apart = is_near && (is_found_elsewhere(a, b) || engine_.are_apart(a.id, b.id));
    if (is_near && !is_asleep && !is_apart) {
      if (candidate.contact != Candidate::kNone) {
        Contact& contact = contacts_[static_cast<std::size_t>(candidate.contact)];
        update_contact(a, b, piece.narrow_phase, contact);
        contact.patches.empty() ? drop(candidate) : note_fixed(candidate, a, b);
      } else if (NarrowPhase::may_touch(a, b)) {
        Contact contact = blank_contact(a, b);
        update_contact(a, b, piece.narrow_phase, contact);
        if (!contact.patches.empty()) {
          piece.made.emplace_back(next, std::move(contact));
          note_fixed(candidate, a, b);
        }
      }
    } else if (!is_near || is_apart) {
      drop(candidate);
      if (!is_near && !a.enlarged.overlaps(b.enlarged)) continue;
    }
    if (next != n) candidates_[next] = candidate;  // a copy onto itself is slower than none
    ++next;
  }
  piece.kept = next - begin;
}

void NativeWorld::update_contact(const Body& a, const Body& b, NarrowPhase& narrow_phase,
                                 Contact& contact) const {
  const bool is_new = narrow_phase.update(a, b, contact);
  if (contact.restitution > 0) find_where_balls_met(a, b, Scalar(settings_.time_step), contact);
  if (a.solid->has_materials() || b.solid->has_materials()) update_materials(a, b, is_new, contact);
  if (a.surface || b.surface) update_surface(a, b, contact);
  // Bodies that come out of each other slide: between what presses from several sides, friction would jam
  // them.
  if (is_opened_one_way(contact)) {
    contact.friction = 0;
  } else if (!contact.surface) {
    contact.friction = usual_friction(a, b);
  }
}

// Surfaces turn with their bodies.
void NativeWorld::update_surface(const Body& a, const Body& b, Contact& contact) {
  const ContactMaterial both = combined(a, nullptr, b, nullptr);
  contact.friction = both.friction;
  contact.surface = std::make_shared<const ContactSurface>(*both.surface);
}

Contact NativeWorld::blank_contact(const Body& a, const Body& b) const {
  const ContactMaterial both = combined(a, nullptr, b, nullptr);
  Contact contact;
  contact.friction = both.friction;
  contact.restitution = both.restitution;
  if (both.surface) contact.surface = std::make_shared<const ContactSurface>(*both.surface);
  return contact;
}

std::int32_t NativeWorld::keep_contact(Contact contact) {
  if (free_contacts_.empty()) {
    contacts_.push_back(std::move(contact));
    return static_cast<std::int32_t>(contacts_.size() - 1);
  }
  const std::int32_t place = free_contacts_.back();
  free_contacts_.pop_back();
  contacts_[static_cast<std::size_t>(place)] = std::move(contact);
  return place;
}

void NativeWorld::drop_contact(Candidate& candidate) {
  if (candidate.contact == Candidate::kNone) return;
  free_contacts_.push_back(candidate.contact);
  candidate.contact = Candidate::kNone;
}

std::span<const ContactPair> NativeWorld::contacts() {
  if (!is_gathered_) gather({});
  return pairs_;
}

// Whether two may meet at speed in a tick: go far for the thinner one, or be driven far for what stands in
// the way. A foot that its servo may drive onto the ground is not, however strong the servo is.
bool meet_at_speed(const Body& a, const Body& b, Scalar dt) {
  const Scalar way = (a.linear - b.linear).norm() * dt + a.swing(dt) + b.swing(dt);
  const Scalar thin = std::min(a.solid->extent(), b.solid->extent());
  const Body* const stands = !a.is_dynamic() ? &a : !b.is_dynamic() ? &b : nullptr;
  const Scalar in_the_way = stands != nullptr ? stands->solid->extent() : thin;
  return way > kHitShare * thin || way + a.surge + b.surge > kHitShare * in_the_way;
}

// m. Contacts of joints know what they bear, and open what has sunk in.
double pressed(const Body& body) { return body.jointed ? 0 : double(body.surge); }

// Two that are deep in each other do not rest, but come apart.
bool NativeWorld::is_at_rest(const Body& a, const Body& b, const Contact& contact,
                             const ContactScale& scale) const {
  constexpr double kDeep = 0.02;  // of the extent
  if (double((a.linear - b.linear).norm()) >= engine_.needs().speed_at_rest()) return false;
  for (const ContactPatch& patch : contact.patches) {
    for (int n = 0; n < patch.count; ++n) {
      if (double(-patch.point[n].gap) > kDeep * scale.extent) return false;
    }
  }
  return true;
}

void NativeWorld::gather(const ParallelFor& parallel) {
  forget_removed();
  const Pieces pieces = pieces_of_candidates();
  run_parallel(parallel, pieces.count(), [&](std::size_t piece) {
    gather(pieces.begin(piece), pieces.end(piece), candidates_pieces_[piece]);
  });
  std::ptrdiff_t pairs = 0;
  for (std::size_t n = 0; n < pieces.count(); ++n) {
    candidates_pieces_[n].first_pair = pairs;
    pairs += std::ssize(candidates_pieces_[n].pairs);
  }
  pairs_.resize(static_cast<std::size_t>(pairs));
  contact_of_pair_.resize(pairs_.size());
  run_parallel(parallel, pieces.count(), [&](std::size_t n) {
    const CandidatesPiece& piece = candidates_pieces_[n];
    std::copy_n(piece.pairs.begin(), piece.pairs.size(), pairs_.begin() + piece.first_pair);
    std::copy_n(piece.contact_of_pair.begin(), piece.pairs.size(),
                contact_of_pair_.begin() + piece.first_pair);
  });
  thin_crowds();
  is_gathered_ = true;
}

void NativeWorld::gather(std::size_t begin, std::size_t end, CandidatesPiece& piece) const {
  piece.pairs.clear();
  piece.contact_of_pair.clear();
  for (std::size_t n = begin; n < end; ++n) {
    const Candidate& candidate = candidates_[n];
    if (candidate.contact == Candidate::kNone) continue;
    const auto place = static_cast<std::size_t>(candidate.contact);
    const Contact& contact = contacts_[place];
    if (contact.patches.empty()) continue;
    const Body& a = body(candidate.slot_a);
    const Body& b = body(candidate.slot_b);
    ContactScale scale = scale_of(a, b);
    scale.rests_on = rests_on(a, b, contact);
    if (!contact.need.is_known()) {
      scale.is_at_rest = is_at_rest(a, b, contact, scale);
      scale.pressed = std::max(pressed(a), pressed(b));
    }
    int substeps = engine_.needs().substeps(contact.need, scale);
    // What follows on joints is stopped by turns of joints and contacts: in smaller steps it goes less far.
    if (contact.is_predicted() && (a.jointed || b.jointed) &&
        meet_at_speed(a, b, Scalar(settings_.time_step)))
      substeps = std::max(substeps, kSubstepsOfHit * settings_.substeps);
    piece.pairs.push_back({candidate.a, candidate.b, candidate.slot_a, candidate.slot_b,
                           contact.is_touching(), contact.restitution > 0 || contact.is_predicted(),
                           static_cast<std::uint16_t>(substeps)});
    piece.contact_of_pair.push_back(place);
  }
}

std::vector<ContactDetail> NativeWorld::touching_patches(std::size_t pair) const {
  const Body& b = body(pairs_[pair].slot_b);
  std::vector<ContactDetail> details;
  for (const ContactPatch& patch : contact(pair).patches) {
    if (!patch.is_touching()) continue;
    ContactDetail& detail = details.emplace_back();
    detail.normal = patch.normal.cast<double>();
    detail.friction = patch.friction_impulse.cast<double>();
    for (int n = 0; n < patch.count; ++n) {
      const ContactPoint& point = patch.point[n];
      detail.impulse += double(point.impulse);
      detail.points.push_back(
          {(b.pose * point.on_b).cast<double>(), double(-point.gap), double(point.impulse)});
    }
  }
  return details;
}

ManifoldState NativeWorld::export_manifold(std::size_t pair) const {
  return {pairs_[pair].a, pairs_[pair].b, encode(contact(pair))};
}

Candidate& NativeWorld::candidate_of(BodySlot slot_a, BodySlot slot_b) {
  const Candidate wanted{body(slot_a).id, body(slot_b).id, slot_a, slot_b};
  const auto place =
      std::lower_bound(candidates_.begin(), candidates_.end(), wanted,
                       [](const Candidate& x, const Candidate& y) { return x.key() < y.key(); });
  if (place != candidates_.end() && place->key() == wanted.key()) return *place;
  return *candidates_.insert(place, wanted);
}

void NativeWorld::import_manifold(const ManifoldState& state) {
  forget_removed();
  Contact contact;
  require(decode(state.points, contact), "contact points must come from an engine of the same precision");
  const std::optional<BodySlot> a = slot_of(state.a);
  const std::optional<BodySlot> b = slot_of(state.b);
  if (!a || !b || !is_wanted(body(*a), body(*b))) return;
  Candidate& candidate = candidate_of(*a, *b);
  drop_contact(candidate);
  candidate.contact = keep_contact(std::move(contact));
  is_gathered_ = false;
}

void NativeWorld::append_numbers(BodySlot slot, std::string& bytes) const {
  Numbers::Body numbers;
  fill(body(slot), settings_.time_step, numbers);
  append(numbers, frame_of(body(slot)), bytes);
}

void NativeWorld::append_pair_numbers(std::size_t pair, std::string& bytes) const {
  const ContactView view{&contact(pair), &body(pairs_[pair].slot_a), &body(pairs_[pair].slot_b)};
  append(view, settings_.time_step, bytes);
}

bool NativeWorld::take_solved(BodySlot slot, std::string_view& bytes) {
  Numbers::Solved solved;
  if (!read(bytes, solved)) return false;
  take(solved, settings_.time_step, body(slot));
  return true;
}

bool NativeWorld::take_solved_pair(std::size_t pair, std::string_view& bytes) {
  Contact& solved = contact(pair);
  std::vector<Numbers::Patch> patches(solved.patches.size());
  std::vector<Numbers::Surface> surfaces(solved.patches.size());
  for (std::size_t p = 0; p < patches.size(); ++p) {
    patches[p].points = solved.patches[p].count;
    if (solved.surface_of(p) != nullptr) patches[p].surface = &surfaces[p];
    if (!read_impulses(bytes, patches[p])) return false;
  }
  const Opening<Scalar> usual(settings_.time_step, settings_.substeps, settings_.substeps);
  take(patches, engine_.needs(), usual, body(pairs_[pair].slot_a), body(pairs_[pair].slot_b), solved);
  return true;
}

}  // namespace tessera::native
