#include "lpss/native/numbers.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lpss/base/bytes.h"
#include "lpss/base/columns.h"
#include "lpss/model/divergence.h"
#include "lpss/model/limits.h"
#include "lpss/native/carrier.h"

namespace tessera::native {
namespace {

// Two free bodies that a sweep has found to meet have met at the end of the tick, as if they bounced at
// hardly any speed: in the next one, they may live in sectors that do not know each other.
constexpr Scalar kMetRestitution = Scalar(1e-6);

constexpr Scalar kBuriedShare = Scalar(0.1);  // of the smallest extent of those that can be pushed

// None for static bodies: they do not move.
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

Numbers::Surface surface_of(const ContactSurface& contact, const ContactPatch& patch) {
  return {.direction = contact.direction,
          .along = contact.along,
          .across = contact.across,
          .drift = contact.velocity - contact.running.cross(patch.normal),
          .torsion = contact.torsion,
          .rolling = contact.rolling,
          .rolling_impulse = patch.rolling_impulse};
}

// The side that has a course, if there is one.
const Body* carrier_of(const ContactView& view) {
  if (has_course(*view.b)) return view.b;
  return has_course(*view.a) ? view.a : nullptr;
}

void set_course(const ContactView& view, const Body& carrier, const ContactPatch& from, double dt,
                Numbers::Patch& patch, Numbers::Course& course) {
  const bool is_a = &carrier == view.a;
  const Body& rider = is_a ? *view.b : *view.a;
  Vector lever = Vector::Zero();
  Vector arm = rider.pose.position - carrier.pose.position;
  for (std::size_t n = 0; n < patch.points; ++n) {
    const auto& point = patch.point[n];
    lever += (is_a ? point.lever_a : point.lever_b) / Scalar(patch.points);
    arm += (is_a ? point.lever_b : point.lever_a) / Scalar(patch.points);
  }
  const bool is_ridden = rides_on(carrier, rider);
  course = course_at(carrier, arm, lever, is_ridden, dt);
  if (!is_a) {
    for (Vector* part : {&course.linear, &course.angular, &course.linear_change, &course.angular_change})
      *part = -*part;
  }
  patch.course = &course;
  if (is_ridden) patch.friction_impulse = turned_with(carrier, from.friction_impulse, dt);
}

// Of impulses that the next tick may start from: none is larger than it takes to stop the heaviest body at
// the highest speed. What they are follows from the contact alone, whoever solves it.
bool are_bounded(const Numbers::Patch& patch) {
  constexpr double kMost = kMassMax * kSpeedMax;  // N s
  const auto within = [](double impulse) { return std::abs(impulse) <= kMost; };
  if (!within(patch.friction_impulse.cast<double>().norm()) || !within(patch.twist_impulse)) return false;
  if (patch.surface && !within(patch.surface->rolling_impulse.cast<double>().norm())) return false;
  return std::all_of(patch.point, patch.point + patch.points,
                     [&](const auto& point) { return within(point.impulse); });
}

}  // namespace

Numbers::Frame frame_of(const Body& body) {
  return {body.pose.rotation, body.pose.position, body.moments, body.inverse_moments,
          body.flies_jointed && !body.turning};
}

void take(const Numbers::Solved& solved, double dt, Body& body) {
  body.fine.reset();
  if (!solved.is_within_bounds(dt)) {
    const Vector gains = velocity_of_gained_energy().cast<Scalar>();
    constexpr Scalar kNone = std::numeric_limits<Scalar>::quiet_NaN();
    body.linear = solved.way == gains ? gains : Vector::Constant(kNone);
    body.angular = body.linear;
    return;
  }
  // What flies keeps to the parabola, with joints or without; end_flight() completes its velocity.
  body.flies = solved.overshoot > 0;
  if (solved.is_pushed) {
    body.linear += solved.linear;
    body.angular += solved.angular;
    if (body.flies) body.pose.position -= body.gravity * (Scalar(dt) * solved.overshoot);
    if (body.turning) body.turn_late(solved.linear, solved.angular, Scalar(dt));
  } else {
    body.coast(Scalar(dt));
  }
  // What is still being pushed out of an overlap does not rest, however slow it is; nor does what is deep in
  // one, or what a moving surface carries.
  const Scalar pushed_max = body.still_limits.linear * Scalar(dt);
  const bool is_corrected = solved.way.squaredNorm() > pushed_max * pushed_max;
  if (is_corrected || solved.is_buried || solved.is_carried) body.still_for = 0;
  body.pose.position += solved.way;
  body.pose.rotation = turned(body.pose.rotation, solved.turn);
}

void look_at(const ContactView& view, ContactHead& head) {
  const Contact& contact = *view.contact;
  head.patches = static_cast<std::uint32_t>(contact.patches.size());
  for (std::size_t n = 0; n < 2; ++n) {
    const Body& side = n == 0 ? *view.a : *view.b;
    head.sides[n] = ContactHead::Side::kPushed;
    if (side.is_dynamic()) continue;
    head.sides[n] = ContactHead::Side::kStill;
    if (side.motion == Motion::kStatic) continue;
    head.sides[n] = ContactHead::Side::kMoving;
    head.linear[n] = side.linear;
    head.angular[n] = side.angular;
  }
  const ContactScale scale = scale_of(*view.a, *view.b);
  head.extent = Scalar(scale.extent);
  head.nimbleness = Scalar(scale.nimbleness);
  head.may_bounce = contact.restitution > 0;
  head.is_deep = deepest_gap(contact) < -Scalar(scale.extent) * kBuriedShare;
  head.carries = contact.surface && contact.surface->moves();
  head.has_surfaces = contact.has_surfaces();
  head.has_course = carrier_of(view) != nullptr;
}

void fill(const ContactView& view, std::size_t place, double dt, Scalar gap_min, Numbers::Patch& into,
          Numbers::Surface* surface, Numbers::Course* course) {
  const Contact& contact = *view.contact;
  const ContactPatch& from = contact.patches[place];
  const ContactMaterial* const own = contact.material_of(place);
  into.friction = own ? own->friction : contact.friction;
  const Scalar restitution = own ? own->restitution : contact.restitution;
  const bool meets = from.is_predicted && view.a->is_dynamic() && view.b->is_dynamic();
  into.restitution = meets ? std::max(restitution, kMetRestitution) : restitution;
  into.is_jointed = false;
  into.points = from.count;
  into.friction_impulse = from.friction_impulse;
  into.twist_impulse = from.twist_impulse;
  const ContactSurface* const given = contact.surface_of(place);
  into.surface = given ? surface : nullptr;
  if (given) *surface = surface_of(*given, from);
  const Columns<Scalar> to_lever_a = to_lever(*view.a);
  const Columns<Scalar> to_lever_b = to_lever(*view.b);
  for (std::size_t n = 0; n < into.points; ++n) {
    const ContactPoint& point = from.point[n];
    into.point[n].lever_a = to_lever_a * point.on_a;
    into.point[n].lever_b = to_lever_b * point.on_b;
    into.point[n].normal = from.normal;
    into.point[n].gap = std::max(point.gap, gap_min);
    into.point[n].impulse = point.impulse;
  }
  into.course = nullptr;
  if (const Body* const carrier = carrier_of(view)) set_course(view, *carrier, from, dt, into, *course);
}

void take(std::span<const Numbers::Patch> patches, const ContactNeeds& needs, const Opening<Scalar>& usual,
          const Body& a, const Body& b, Contact& contact) {
  if (!std::ranges::all_of(patches, are_bounded)) return drop_impulses(contact);
  ContactScale scale = scale_of(a, b);
  const Scalar gap_min = usual.deepest_gap(Scalar(scale.extent), 1);
  // Patches that press against each other bear nothing.
  Eigen::Vector3d load = Eigen::Vector3d::Zero();
  double mobility = 0;
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const Numbers::Patch& patch = patches[p];
    ContactPatch& into = contact.patches[p];
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
  const auto is_free = [](const Body& body) { return body.is_dynamic() && !body.jointed; };
  scale.is_found_at_once = mobility > 0 && !is_free(a) && !is_free(b);
  needs.note(contact.need, load.norm(), scale);
}

// --- as bytes ---

namespace {

// Each struct is described once, for reading and writing.
template <typename B, typename F, typename Visit>
void visit_body(B& body, F& frame, const Visit& visit) {
  for (auto* v : {&body.linear, &body.angular, &body.linear_force, &body.angular_force, &frame.position,
                  &frame.moments, &frame.inverse_moments})
    visit(*v);
  visit(body.inverse_mass);
  visit(body.inverse_inertia);
  visit(frame.rotation);
  visit(frame.may_fly);
}

template <typename H, typename Visit>
void visit_head(H& head, const Visit& visit) {
  visit(head.patches);
  for (std::size_t n = 0; n < 2; ++n) {
    visit(head.sides[n]);
    if (head.sides[n] != ContactHead::Side::kMoving) continue;
    visit(head.linear[n]);
    visit(head.angular[n]);
  }
  visit(head.extent);
  visit(head.nimbleness);
  for (auto* flag : {&head.may_bounce, &head.is_deep, &head.carries, &head.has_surfaces, &head.has_course})
    visit(*flag);
}

template <typename S, typename Visit>
void visit_surface(S& surface, const Visit& visit) {
  for (auto* v : {&surface.direction, &surface.drift, &surface.rolling_impulse}) visit(*v);
  for (auto* number : {&surface.along, &surface.across, &surface.torsion, &surface.rolling}) visit(*number);
}

template <typename C, typename Visit>
void visit_course(C& course, const Visit& visit) {
  for (auto* v : {&course.linear, &course.angular, &course.linear_change, &course.angular_change}) visit(*v);
}

template <typename P, typename Visit>
void visit_point(P& point, const Visit& visit) {
  for (auto* v : {&point.lever_a, &point.lever_b, &point.normal}) visit(*v);
  visit(point.gap);
  visit(point.impulse);
}

template <typename S, typename Visit>
void visit_solved(S& solved, const Visit& visit) {
  for (auto* v : {&solved.linear, &solved.angular, &solved.way, &solved.turn}) visit(*v);
  for (auto* flag : {&solved.is_pushed, &solved.is_buried, &solved.is_carried}) visit(*flag);
  visit(solved.overshoot);
}

template <typename P, typename Visit>
void visit_impulses(P& patch, const Visit& visit) {
  visit(patch.is_jointed);
  visit(patch.mobility);
  visit(patch.friction_impulse);
  visit(patch.twist_impulse);
  for (auto& point : patch.point) visit(point.impulse);
}

// Takes what was read off the front.
bool take_off(std::string_view& bytes, const ByteReader& read) {
  bytes.remove_prefix(bytes.size() - read.left());
  return !read.is_short();
}

}  // namespace

void append(const Numbers::Body& body, const Numbers::Frame& frame, std::string& bytes) {
  visit_body(body, frame, ByteWriter(bytes));
}

bool read(std::string_view& bytes, Numbers::Body& body, Numbers::Frame& frame) {
  const ByteReader read(bytes);
  visit_body(body, frame, read);
  return take_off(bytes, read);
}

void append(const ContactView& view, double dt, std::string& bytes) {
  const ByteWriter write(bytes);
  ContactHead head;
  look_at(view, head);
  visit_head(head, write);
  for (std::size_t p = 0; p < view.contact->patches.size(); ++p) {
    Numbers::Patch patch;
    Numbers::Surface surface;
    Numbers::Course course;
    fill(view, p, dt, std::numeric_limits<Scalar>::lowest(), patch, &surface, &course);
    write(patch.friction);
    write(patch.restitution);
    write(static_cast<std::uint8_t>(patch.points));
    write(patch.friction_impulse);
    write(patch.twist_impulse);
    for (std::size_t n = 0; n < patch.points; ++n) visit_point(patch.point[n], write);
    write(patch.surface != nullptr);
    if (patch.surface) visit_surface(surface, write);
    if (patch.course) visit_course(course, write);
  }
}

bool read(std::string_view& bytes, ContactHead& head) {
  const ByteReader read(bytes);
  visit_head(head, read);
  return take_off(bytes, read) && *std::ranges::max_element(head.sides) <= ContactHead::Side::kMoving;
}

bool read(std::string_view& bytes, const ContactHead& head, Scalar gap_min, Numbers::Patch& patch,
          Numbers::Surface* surface, Numbers::Course* course) {
  const ByteReader read(bytes);
  read(patch.friction);
  read(patch.restitution);
  patch.is_jointed = false;
  patch.points = read.get<std::uint8_t>();
  if (patch.points > kPatchPointsMax) return false;
  read(patch.friction_impulse);
  read(patch.twist_impulse);
  for (std::size_t n = 0; n < patch.points; ++n) {
    visit_point(patch.point[n], read);
    patch.point[n].gap = std::max(patch.point[n].gap, gap_min);
  }
  const bool has_surface = read.get<bool>();
  if (has_surface && !head.has_surfaces) return false;
  patch.surface = has_surface ? surface : nullptr;
  if (has_surface) visit_surface(*surface, read);
  patch.course = head.has_course ? course : nullptr;
  if (head.has_course) visit_course(*course, read);
  return take_off(bytes, read);
}

void append(const Numbers::Solved& solved, std::string& bytes) { visit_solved(solved, ByteWriter(bytes)); }

bool read(std::string_view& bytes, Numbers::Solved& solved) {
  const ByteReader read(bytes);
  visit_solved(solved, read);
  return take_off(bytes, read);
}

void append_impulses(const Numbers::Patch& patch, std::string& bytes) {
  const ByteWriter write(bytes);
  visit_impulses(patch, write);
  write(patch.surface ? patch.surface->rolling_impulse : Vector(Vector::Zero()));
}

bool read_impulses(std::string_view& bytes, Numbers::Patch& patch) {
  const ByteReader read(bytes);
  visit_impulses(patch, read);
  const auto rolling = read.get<Vector>();
  if (patch.surface) patch.surface->rolling_impulse = rolling;
  return take_off(bytes, read);
}

}  // namespace tessera::native
