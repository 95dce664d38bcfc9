// The streams of tessera/c.h.
#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "client_sdk/src/c_values.h"

namespace {

using tessera::c::body_for_c;
using tessera::c::code_of;
using tessera::c::duration_of;
using tessera::c::give;
using tessera::c::position_for_c;
using tessera::c::write;

constexpr std::uint64_t kJointsMax = 10'000;

}  // namespace

struct tessera_stream {
  std::variant<std::unique_ptr<tessera::BodyStream>, std::unique_ptr<tessera::ContactStream>,
               std::unique_ptr<tessera::JointStream>, std::unique_ptr<tessera::ProgramStream>,
               std::unique_ptr<tessera::SeamStream>>
      stream;
  // Of the last tick: the caller has pointers into them.
  std::vector<tessera::ProgramSample> programs = {};
  std::vector<std::vector<uint64_t>> islands = {};
};

namespace {

static_assert(static_cast<int>(tessera::ContactPhase::kEnd) == TESSERA_END);
static_assert(static_cast<int>(tessera::ContactPhase::kBegin) == TESSERA_BEGIN);
static_assert(static_cast<int>(tessera::ContactPhase::kPersist) == TESSERA_PERSIST);

std::vector<tessera::BodyId> ids_of(const uint64_t* ids, size_t count) {
  std::vector<tessera::BodyId> result;
  for (size_t n = 0; n < count; ++n) result.push_back(tessera::BodyId{ids[n]});
  return result;
}

tessera_contact contact_for_c(const tessera::ContactSample& contact) {
  tessera_contact result{};
  result.a = contact.a.value;
  result.b = contact.b.value;
  result.phase = static_cast<tessera_phase>(contact.phase);
  result.trigger = contact.trigger;
  if (contact.trigger || contact.phase == tessera::ContactPhase::kEnd) return result;
  result.position = position_for_c(contact.position);
  write(contact.normal, result.normal);
  result.impulse = contact.impulse;
  write(contact.friction, result.friction);
  return result;
}

tessera_joint joint_for_c(const tessera::JointSample& joint) {
  const tessera::JointState& state = joint.state;
  return {.id = joint.id.value,
          .position = {state.position[0], state.position[1]},
          .velocity = {state.velocity[0], state.velocity[1]},
          .gap = state.gap,
          .twist = state.twist,
          .asleep = joint.asleep};
}

tessera_program program_for_c(const tessera::ProgramSample& program) {
  return {.body = program.body.value,
          .program = program.program,
          .stopped = program.stopped,
          .kind = program.kind.c_str(),
          .values = program.values.data(),
          .value_count = program.values.size()};
}

tessera_clone clone_for_c(const tessera::CloneSample& clone) {
  const tessera::SectorIndex& sector = clone.sector;
  return {.body = clone.body.value,
          .sector = {sector.i, sector.j, sector.k},
          .server = clone.server,
          .frame = sector.frame};
}

std::vector<uint64_t> bodies_of(const tessera::IslandSample& island) {
  std::vector<uint64_t> bodies;
  for (const tessera::BodyId body : island.bodies) bodies.push_back(body.value);
  return bodies;
}

// A stream that was opened.
template <typename Kind>
tessera_code open(absl::StatusOr<std::unique_ptr<Kind>> opened, tessera_stream** stream) {
  return give(std::move(opened),
              [&](std::unique_ptr<Kind> made) { *stream = new tessera_stream{std::move(made)}; });
}

// The first ones that fit, and the number of all.
template <typename Sample, typename Convert>
void copy(const std::vector<Sample>& samples, Convert convert, auto* to, size_t capacity, size_t* count) {
  *count = samples.size();
  std::transform(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(std::min(capacity, *count)),
                 to, convert);
}

// Calls use(frame) with the next one of a stream of this kind.
template <typename Kind, typename Use>
tessera_code next(tessera_stream* stream, double timeout, uint64_t* tick, Use use) {
  const auto* of_kind = std::get_if<std::unique_ptr<Kind>>(&stream->stream);
  if (of_kind == nullptr)
    return code_of(absl::InvalidArgumentError("the stream was opened to watch something else"));
  return give((*of_kind)->next(duration_of(timeout)), [&](auto frame) {
    if (tick != nullptr) *tick = frame.tick;
    use(std::move(frame));
  });
}

}  // namespace

tessera_code tessera_watch(tessera_client* client, const uint64_t* ids, size_t count,
                           tessera_stream** stream) {
  tessera::BodyFilter filter;
  filter.complete = true;
  filter.ids = ids_of(ids, count);
  return open(client->client->watch_bodies(filter), stream);
}

tessera_code tessera_watch_region(tessera_client* client, const tessera_position* centre,
                                  const double half_size[3], tessera_stream** stream) {
  tessera::BodyFilter filter;
  filter.complete = true;
  filter.region = {tessera::c::position_of(*centre), Eigen::Vector3d(half_size)};
  return open(client->client->watch_bodies(filter), stream);
}

tessera_code tessera_next(tessera_stream* stream, double timeout, uint64_t* tick, tessera_body* bodies,
                          size_t capacity, size_t* count) {
  return next<tessera::BodyStream>(stream, timeout, tick, [&](const tessera::BodyFrame& frame) {
    copy(frame.bodies, body_for_c, bodies, capacity, count);
  });
}

tessera_code tessera_watch_contacts(tessera_client* client, const uint64_t* ids, size_t count,
                                    bool persisting, double impulse_min, tessera_stream** stream) {
  tessera::ContactFilter filter;
  filter.ids = ids_of(ids, count);
  filter.persisting = persisting;
  filter.impulse_min = impulse_min;
  return open(client->client->watch_contacts(filter), stream);
}

tessera_code tessera_next_contacts(tessera_stream* stream, double timeout, uint64_t* tick,
                                   tessera_contact* contacts, size_t capacity, size_t* count) {
  return next<tessera::ContactStream>(stream, timeout, tick, [&](const tessera::ContactFrame& frame) {
    copy(frame.contacts, contact_for_c, contacts, capacity, count);
  });
}

tessera_code tessera_watch_joints(tessera_client* client, const char* prefix, tessera_stream** stream) {
  const absl::StatusOr<tessera::FoundJoints> found = client->client->find_joints(prefix, kJointsMax);
  if (!found.ok()) return code_of(found.status());
  if (found->joints.empty())
    return code_of(absl::NotFoundError(absl::StrCat("no joint has a name that begins with '", prefix, "'")));
  return open(client->client->watch_joints(found->joints), stream);
}

tessera_code tessera_next_joints(tessera_stream* stream, double timeout, uint64_t* tick,
                                 tessera_joint* joints, size_t capacity, size_t* count) {
  return next<tessera::JointStream>(stream, timeout, tick, [&](const tessera::JointFrame& frame) {
    copy(frame.joints, joint_for_c, joints, capacity, count);
  });
}

tessera_code tessera_watch_programs(tessera_client* client, const uint64_t* ids, size_t count,
                                    const char* kind, tessera_stream** stream) {
  tessera::ProgramFilter filter;
  filter.ids = ids_of(ids, count);
  if (kind != nullptr) filter.kind = kind;
  return open(client->client->watch_programs(filter), stream);
}

tessera_code tessera_next_programs(tessera_stream* stream, double timeout, uint64_t* tick,
                                   tessera_program* programs, size_t capacity, size_t* count) {
  return next<tessera::ProgramStream>(stream, timeout, tick, [&](tessera::ProgramFrame frame) {
    stream->programs = std::move(frame.programs);
    copy(stream->programs, program_for_c, programs, capacity, count);
  });
}

tessera_code tessera_watch_seams(tessera_client* client, tessera_stream** stream) {
  return open(client->client->watch_seams(), stream);
}

tessera_code tessera_next_seams(tessera_stream* stream, double timeout, uint64_t* tick, tessera_clone* clones,
                                size_t clone_capacity, size_t* clone_count, tessera_island* islands,
                                size_t island_capacity, size_t* island_count) {
  return next<tessera::SeamStream>(stream, timeout, tick, [&](const tessera::SeamFrame& frame) {
    copy(frame.clones, clone_for_c, clones, clone_capacity, clone_count);
    *island_count = frame.islands.size();
    stream->islands.clear();
    for (const tessera::IslandSample& island : frame.islands) {
      const std::vector<uint64_t>& bodies = stream->islands.emplace_back(bodies_of(island));
      const size_t place = stream->islands.size() - 1;
      if (place < island_capacity) islands[place] = {island.id.value, bodies.data(), bodies.size()};
    }
  });
}

void tessera_unwatch(tessera_stream* stream) { delete stream; }
