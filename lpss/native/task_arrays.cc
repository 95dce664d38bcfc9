#include "lpss/native/task_arrays.h"

#include <algorithm>
#include <numeric>

#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

constexpr std::size_t kContactsInPiece = 128;

// Which worlds do when they are first asked for one: before several threads do.
void let_worlds_gather(const SolveTask& task) {
  const SectorWorld* gathered = nullptr;
  for (const WorldPair& contact : task.contacts) {
    if (contact.world != nullptr && contact.world != gathered) contact.world->contacts();
    gathered = contact.world;
  }
}

std::size_t size_of_solved() {
  static const std::size_t size = [] {
    std::string bytes;
    append(Numbers::Solved{}, bytes);
    return bytes.size();
  }();
  return size;
}

std::size_t size_of_impulses() {
  static const std::size_t size = [] {
    std::string bytes;
    append_impulses(Numbers::Patch{}, bytes);
    return bytes.size();
  }();
  return size;
}

// So that they end there.
void put(const std::string& bytes, std::size_t end, std::string& into) {
  bytes.copy(into.data() + end - bytes.size(), bytes.size());
}

void require_shipped(bool is_read) {
  require(is_read, "what is shipped must come from an engine of the same precision");
}

}  // namespace

void TaskArrays::gather(const SolveTask& task, std::span<const std::size_t> islands, double dt, int steps,
                        const ParallelFor& parallel) {
  task_ = &task;
  dt_ = dt;
  choose(islands);
  gather_bodies(parallel);
  gather_contacts(steps, parallel);
  find_flying(islands, steps);
}

void TaskArrays::gather_joints(const SolveTask& task, double dt, const ParallelFor& parallel) {
  task_ = &task;
  dt_ = dt;
  islands_.joints = task.joints;
  if (task.joints.empty()) return;
  bodies_.resize(task.bodies.size());
  std::iota(bodies_.begin(), bodies_.end(), std::size_t{0});
  gather_bodies(parallel);
}

// What of the task is in the arrays, in its order.
void TaskArrays::choose(std::span<const std::size_t> islands) {
  bodies_.clear();
  joints_.clear();
  islands_.joints.clear();
  std::size_t contacts = 0;
  for (const std::size_t n : islands) {
    const IslandEnd begin = n > 0 ? task_->islands[n - 1] : IslandEnd{};
    const IslandEnd& end = task_->islands[n];
    const std::size_t shift = bodies_.size() - begin.bodies;
    for (std::size_t body = begin.bodies; body < end.bodies; ++body) bodies_.push_back(body);
    if (sources_.size() < contacts + end.contacts - begin.contacts)
      sources_.resize(contacts + end.contacts - begin.contacts);
    for (std::size_t pair = begin.contacts; pair < end.contacts; ++pair) {
      Source& source = sources_[contacts++];
      source.pair = &task_->contacts[pair];
      source.shift = shift;
    }
    for (std::size_t joint = begin.joints; joint < end.joints; ++joint) {
      joints_.push_back(joint);
      IslandJoint& own = islands_.joints.emplace_back(task_->joints[joint]);
      own.child += shift;
      if (own.has_parent()) own.parent += shift;
    }
  }
  sources_.resize(contacts);
}

void TaskArrays::gather_bodies(const ParallelFor& parallel) {
  islands_.dynamics = bodies_.size();
  islands_.bodies.resize(islands_.dynamics);
  if (!islands_.joints.empty()) islands_.frames.resize(islands_.dynamics);
  run_in_pieces(parallel, islands_.dynamics, kBodiesInPiece, [&](std::size_t place) { gather_body(place); });
  islands_.bodies.emplace_back();  // the fixed one
  islands_.solved.assign(islands_.dynamics, {});
}

void TaskArrays::gather_body(std::size_t place) {
  const WorldBody& from = task_->bodies[bodies_[place]];
  const bool has_frame = !islands_.joints.empty();
  if (from.world != nullptr) {
    const Body& body = body_of(from);
    fill(body, dt_, islands_.bodies[place]);
    if (has_frame) islands_.frames[place] = frame_of(body);
    return;
  }
  std::string_view bytes = task_->shipped_bodies[static_cast<std::size_t>(from.slot)];
  Numbers::Frame frame;
  require_shipped(read(bytes, islands_.bodies[place], frame) && bytes.empty());
  if (has_frame) islands_.frames[place] = frame;
}

// On several threads, but for what makes room: that is done contact by contact.
void TaskArrays::gather_contacts(int steps, const ParallelFor& parallel) {
  let_worlds_gather(*task_);
  run_in_pieces(parallel, sources_.size(), kContactsInPiece, [&](std::size_t n) { look_at(sources_[n]); });
  kinematics_.clear();
  islands_.contacts.clear();
  islands_.surfaces.clear();
  islands_.courses.clear();
  std::size_t patches = 0;
  for (Source& source : sources_) {
    islands_.contacts.push_back({patches, source.head.patches, source.head.may_bounce});
    patches += source.head.patches;
    make_room(source);
  }
  islands_.patches.resize(patches);
  const Opening<Scalar> opening(dt_, settings_.substeps, steps);
  run_in_pieces(parallel, sources_.size(), kContactsInPiece, [&](std::size_t n) {
    const ContactHead& head = sources_[n].head;
    fill_patches(sources_[n], islands_.contacts[n].first, opening.deepest_gap(head.extent, head.nimbleness));
  });
}

void TaskArrays::look_at(Source& source) const {
  if (source.pair->world == nullptr) {
    source.contact = nullptr;
    source.bodies = {};
    source.shipped = task_->shipped_pairs[source.pair->pair];
    require_shipped(read(source.shipped, source.head));
    return;
  }
  auto& world = static_cast<NativeWorld&>(*source.pair->world);
  const ContactPair& pair = world.contacts()[source.pair->pair];
  source.contact = &world.contact(source.pair->pair);
  source.bodies = {&world.body(pair.slot_a), &world.body(pair.slot_b)};
  source.shipped = {};
  native::look_at(source.view(), source.head);
}

std::size_t TaskArrays::place_of(const Source& source, std::size_t side) {
  using Side = ContactHead::Side;
  const std::uint32_t in_task = side == 0 ? source.pair->a : source.pair->b;
  if (source.head.sides[side] == Side::kPushed && in_task != WorldPair::kFixed) return in_task + source.shift;
  if (source.head.sides[side] != Side::kMoving) return islands_.fixed();
  const std::size_t next = islands_.bodies.size();
  std::size_t place = next;
  if (source.bodies[side] != nullptr)
    place = kinematics_.try_emplace(source.bodies[side], next).first->second;
  if (place == next)
    islands_.bodies.push_back({.linear = source.head.linear[side], .angular = source.head.angular[side]});
  return place;
}

// Room for what its patches refer to; and notes what the contact does to its bodies.
void TaskArrays::make_room(Source& source) {
  const ContactHead& head = source.head;
  source.first_surface = islands_.surfaces.size();
  source.first_course = islands_.courses.size();
  if (head.has_surfaces) islands_.surfaces.resize(source.first_surface + head.patches);
  if (head.has_course) islands_.courses.resize(source.first_course + head.patches);
  for (std::size_t side = 0; side < 2; ++side) {
    source.places[side] = place_of(source, side);
    if (source.places[side] >= islands_.dynamics) continue;
    Numbers::Solved& notes = islands_.solved[source.places[side]];
    if (head.carries) notes.is_carried = true;
    if (head.is_deep) notes.is_buried = true;
    // Near what they do not bounce on, bodies fall by what a step of the solver makes of it, which damps
    // rattling.
    if (!head.may_bounce) notes.is_pushed = true;
  }
}

void TaskArrays::fill_patches(const Source& source, std::size_t first, Scalar gap_min) {
  std::string_view bytes = source.shipped;
  for (std::size_t p = 0; p < source.head.patches; ++p) {
    Numbers::Patch& patch = islands_.patches[first + p];
    patch.a = source.places[0];
    patch.b = source.places[1];
    Numbers::Surface* const surface = islands_.surfaces.data() + source.first_surface + p;
    Numbers::Course* const course = islands_.courses.data() + source.first_course + p;
    if (source.contact != nullptr) {
      fill(source.view(), p, dt_, gap_min, patch, surface, course);
    } else {
      require_shipped(read(bytes, source.head, gap_min, patch, surface, course));
    }
  }
  require_shipped(bytes.empty());
}

// Islands with joints that touch nothing immovable. They are never divided among solvers: all of each is
// here.
void TaskArrays::find_flying(std::span<const std::size_t> islands, int steps) {
  if (islands_.joints.empty()) return;
  const auto can_be_pushed = [&](std::size_t place) { return place < islands_.dynamics; };
  IslandEnd from;
  for (const std::size_t n : islands) {
    const IslandEnd begin = n > 0 ? task_->islands[n - 1] : IslandEnd{};
    const IslandEnd& end = task_->islands[n];
    const IslandEnd size{end.bodies - begin.bodies, end.contacts - begin.contacts, end.joints - begin.joints};
    const std::span joints = std::span(islands_.joints).subspan(from.joints, size.joints);
    const bool flies =
        !joints.empty() && std::ranges::all_of(joints, &IslandJoint::has_parent) &&
        std::ranges::all_of(std::span(islands_.frames).subspan(from.bodies, size.bodies),
                            &Numbers::Frame::may_fly) &&
        std::ranges::all_of(std::span(sources_).subspan(from.contacts, size.contacts),
                            [&](const Source& source) {
                              return can_be_pushed(source.places[0]) && can_be_pushed(source.places[1]);
                            });
    for (std::size_t place = from.bodies; flies && place < from.bodies + size.bodies; ++place)
      islands_.solved[place].overshoot = Scalar(dt_ / steps / 2);
    from.bodies += size.bodies;
    from.contacts += size.contacts;
    from.joints += size.joints;
  }
}

void TaskArrays::make_room(const SolveTask& task, SolvedTask& solved) {
  std::size_t size = 0;
  for (std::size_t n = 0; n < task.shipped_bodies.size(); ++n)
    solved.body_ends.push_back(size += size_of_solved());
  solved.bodies.resize(size);
  size = 0;
  for (std::string_view bytes : task.shipped_pairs) {
    ContactHead head;
    require_shipped(read(bytes, head));
    solved.pair_ends.push_back(size += head.patches * size_of_impulses());
  }
  solved.pairs.resize(size);
  solved.joint_loads.resize(task.joints.size());
}

void TaskArrays::put_back(SolvedTask* solved, const ParallelFor& parallel) const {
  run_in_pieces(parallel, islands_.dynamics, kBodiesInPiece,
                [&](std::size_t place) { put_back_body(place, solved); });
  run_in_pieces(parallel, sources_.size(), kContactsInPiece,
                [&](std::size_t n) { put_back_pair(n, solved); });
  if (solved == nullptr) return;
  for (std::size_t n = 0; n < joints_.size(); ++n) solved->joint_loads[joints_[n]] = islands_.joint_loads[n];
}

void TaskArrays::put_back_body(std::size_t place, SolvedTask* solved) const {
  const WorldBody& body = task_->bodies[bodies_[place]];
  if (body.world != nullptr) return take(islands_.solved[place], dt_, body_of(body));
  if (solved == nullptr) return;
  std::string bytes;
  append(islands_.solved[place], bytes);
  put(bytes, solved->body_ends[static_cast<std::size_t>(body.slot)], solved->bodies);
}

void TaskArrays::put_back_pair(std::size_t n, SolvedTask* solved) const {
  const Source& source = sources_[n];
  const auto& contact = islands_.contacts[n];
  const auto patches = std::span(islands_.patches).subspan(contact.first, contact.patches);
  if (source.contact != nullptr) {
    return take(patches, needs_, usual_, *source.bodies[0], *source.bodies[1], *source.contact);
  }
  if (solved == nullptr) return;
  std::string bytes;
  for (const Numbers::Patch& patch : patches) append_impulses(patch, bytes);
  put(bytes, solved->pair_ends[source.pair->pair], solved->pairs);
}

}  // namespace tessera::native
