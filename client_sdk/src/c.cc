#include "tessera/c.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>
#include <absl/time/time.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/src/c_values.h"
#include "tessera/batch_json.h"
#include "tessera/client.h"
#include "tessera/world_message.h"

namespace {

// The kind of each query is known by its place.
struct QueryPlaces {
  std::map<size_t, tessera::QueryPlace<std::vector<tessera::RayResult>>> rays;
  std::map<size_t, tessera::QueryPlace<std::vector<tessera::BodySample>>> states;
};

}  // namespace

struct tessera_batch {
  tessera::Batch batch;
  QueryPlaces places;
};

struct tessera_answers {
  tessera::Answers answers;
  QueryPlaces places;
  std::string json;
};

struct tessera_pending {
  std::future<absl::StatusOr<tessera::Answers>> answers;  // not valid once they were given
  QueryPlaces places;
};

namespace {

using Eigen::Vector3d;
using tessera::c::body_for_c;
using tessera::c::code_of;
using tessera::c::duration_of;
using tessera::c::give;
using tessera::c::position_for_c;
using tessera::c::position_of;
using tessera::c::write;

constexpr absl::string_view kStates[] = {"empty", "loading", "paused", "running", "failed", "recovering"};

constexpr absl::Duration kForever = absl::Hours(24 * 365 * 100);  // clocks can count so far

thread_local std::string error_message;

tessera_code give_tick(const absl::StatusOr<tessera::Tick>& result, uint64_t* tick) {
  return give(result, [&](tessera::Tick value) {
    if (tick != nullptr) *tick = value;
  });
}

tessera_status status_for_c(const tessera::ClusterStatus& status) {
  const auto state = std::find(std::begin(kStates), std::end(kStates), status.state);
  return {
      .state = static_cast<tessera_state>(state - std::begin(kStates)),
      .tick = status.tick,
      .time = status.time,
      .real_time_factor = status.real_time_factor,
      .servers = status.servers.size(),
      .bodies = status.bodies,
      .bodies_awake = status.counts.bodies_awake,
      .sectors = status.counts.sectors,
      .contacts = status.counts.contacts,
      .tick_ms_mean = status.tick_ms.mean,
      .tick_ms_p50 = status.tick_ms.p50,
      .tick_ms_p99 = status.tick_ms.p99,
      .time_step = status.settings ? status.settings->time_step : 0,
      .sector_size = status.settings ? status.settings->sector_size : 0,
  };
}

tessera_hit hit_for_c(const tessera::RayResult& found) {
  tessera_hit hit{};
  hit.body = found.body.value;
  hit.distance = found.distance;
  hit.position = position_for_c(found.position);
  write(found.normal, hit.normal);
  return hit;
}

Vector3d vector_of(const double* vector) {
  return vector == nullptr ? Vector3d(Vector3d::Zero()) : Vector3d(vector);
}

tessera::TargetPose pose_of(const tessera_position& position, const double* orientation) {
  tessera::TargetPose pose{position_of(position)};
  if (orientation != nullptr) pose.orientation = Eigen::Quaterniond(orientation);
  return pose;
}

tessera_code no_such_result(size_t place) {
  return code_of(absl::InvalidArgumentError(
      absl::StrCat("place ", place, ": the batch has no query of this kind there")));
}

tessera_code spawn(tessera_client* client, const char* name, tessera::Shape shape, double mass,
                   const tessera_position* position, uint64_t* id) {
  const tessera::NewBody body = tessera::solid(name, std::move(shape), mass, position_of(*position));
  return give(client->client->spawn(body), [&](const tessera::Spawned& spawned) { *id = spawned.id.value; });
}

}  // namespace

namespace tessera::c {

tessera_code code_of(const absl::Status& status) {
  error_message = std::string(status.message());
  return static_cast<tessera_code>(status.code());
}

}  // namespace tessera::c

const char* tessera_error_message(void) { return error_message.c_str(); }

void tessera_relative_to(const tessera_position* point, const int64_t sector[3], double sector_size,
                         double metres[3]) {
  const tessera::SectorIndex from{sector[0], sector[1], sector[2], point->frame};
  write(relative_to(position_of(*point), from, sector_size), metres);
}

tessera_code tessera_connect(const char* address, double timeout, tessera_client** client) {
  return tessera_connect_with_keys(address, nullptr, timeout, client);
}

tessera_code tessera_connect_with_keys(const char* address, const char* keys, double timeout,
                                       tessera_client** client) {
  return give(tessera::Client::connect(address, duration_of(timeout), keys != nullptr ? keys : ""),
              [&](std::unique_ptr<tessera::Client> made) { *client = new tessera_client{std::move(made)}; });
}

void tessera_disconnect(tessera_client* client) { delete client; }

tessera_code tessera_load(tessera_client* client, const char* file, bool replace) {
  const absl::StatusOr<tessera::WorldDescription> world = tessera::read_world_message(file);
  if (!world.ok()) return code_of(world.status());
  return code_of(client->client->load(*world, replace).status());
}

tessera_code tessera_snapshot(tessera_client* client, const char* file, uint64_t* tick) {
  return give(client->client->snapshot(file), [&](const tessera::SnapshotSummary& summary) {
    if (tick != nullptr) *tick = summary.tick;
  });
}

tessera_code tessera_restore(tessera_client* client, const char* file, bool replace) {
  return code_of(client->client->restore(file, replace).status());
}

tessera_code tessera_spawn_box(tessera_client* client, const char* name, const double size[3], double mass,
                               const tessera_position* position, uint64_t* id) {
  return spawn(client, name, tessera::box(size[0], size[1], size[2]), mass, position, id);
}

tessera_code tessera_spawn_sphere(tessera_client* client, const char* name, double radius, double mass,
                                  const tessera_position* position, uint64_t* id) {
  return spawn(client, name, tessera::sphere(radius), mass, position, id);
}

tessera_code tessera_find(tessera_client* client, const char* name, uint64_t* id) {
  return give(client->client->find(name), [&](const tessera::FoundBody& body) { *id = body.id.value; });
}

tessera_code tessera_apply_impulse(tessera_client* client, uint64_t id, const double impulse[3],
                                   const double lever[3]) {
  return code_of(
      client->client->apply_impulse(tessera::BodyId{id}, vector_of(impulse), vector_of(lever)).status());
}

tessera_code tessera_set_surface_motion(tessera_client* client, uint64_t id, const double velocity[3],
                                        const double running[3]) {
  return code_of(
      client->client->set_surface_motion(tessera::BodyId{id}, vector_of(velocity), vector_of(running))
          .status());
}

tessera_code tessera_step(tessera_client* client, uint64_t ticks, uint64_t* tick) {
  return give_tick(client->client->step(ticks), tick);
}

tessera_code tessera_pause(tessera_client* client, uint64_t* tick) {
  return give_tick(client->client->pause(), tick);
}

tessera_code tessera_resume(tessera_client* client, double real_time_factor, uint64_t* tick) {
  return give_tick(client->client->resume(real_time_factor), tick);
}

tessera_code tessera_get_status(tessera_client* client, tessera_status* status) {
  return give(client->client->status(),
              [&](const tessera::ClusterStatus& found) { *status = status_for_c(found); });
}

tessera_code tessera_divergences(tessera_client* client, tessera_divergence* divergences, size_t capacity,
                                 size_t* count, uint64_t* total) {
  return give(client->client->status(), [&](const tessera::ClusterStatus& found) {
    *count = std::min(capacity, found.divergences.size());
    *total = found.counts_since_load.diverged;
    std::transform(found.divergences.begin(), found.divergences.begin() + static_cast<std::ptrdiff_t>(*count),
                   divergences, [](const tessera::NamedDivergence& one) {
                     return tessera_divergence{one.tick, one.body.value, one.joint.value, name_of(one.kind)};
                   });
  });
}

tessera_code tessera_find_frame(tessera_client* client, const char* name, tessera_frame* frame) {
  return give(client->client->find_frame(name), [&](const tessera::FoundFrame& found) {
    *frame = {.body = found.body.value, .position = {}, .orientation = {}};
    write(found.pose.position, frame->position);
    std::copy_n(found.pose.orientation.coeffs().data(), 4, frame->orientation);
  });
}

tessera_code tessera_hash(tessera_client* client, char hash[33], uint64_t* tick) {
  return give(client->client->hash(), [&](const tessera::HashAt& found) {
    const std::size_t length = found.hash.copy(hash, 32);
    hash[length] = '\0';
    if (tick != nullptr) *tick = found.tick;
  });
}

tessera_code tessera_raycast(tessera_client* client, const tessera_position* origin,
                             const double direction[3], double length, tessera_hit* hit) {
  const tessera::RayQuery ray{
      .origin = position_of(*origin), .direction = vector_of(direction), .length = length};
  return give(client->client->raycast(ray), [&](const std::optional<tessera::RayResult>& found) {
    *hit = found ? hit_for_c(*found) : tessera_hit{};
  });
}

tessera_code tessera_batch_new(const char* json, tessera_batch** batch) {
  return give(tessera::batch_from_json(json == nullptr ? "{}" : json), [&](tessera::Batch made) {
    *batch = new tessera_batch{std::move(made), {}};
  });
}

void tessera_batch_free(tessera_batch* batch) { delete batch; }

void tessera_batch_set_velocity(tessera_batch* batch, uint64_t body, const double linear[3],
                                const double angular[3]) {
  batch->batch.commands.set_velocity(tessera::BodyId{body}, vector_of(linear), vector_of(angular));
}

void tessera_batch_apply_impulse(tessera_batch* batch, uint64_t body, const double impulse[3],
                                 const double lever[3]) {
  batch->batch.commands.apply_impulse(tessera::BodyId{body}, vector_of(impulse), vector_of(lever));
}

void tessera_batch_apply_force(tessera_batch* batch, uint64_t body, const double force[3],
                               const double torque[3]) {
  batch->batch.commands.apply_force(tessera::BodyId{body}, vector_of(force), vector_of(torque));
}

void tessera_batch_teleport(tessera_batch* batch, uint64_t body, const tessera_position* position,
                            const double orientation[4]) {
  batch->batch.commands.teleport(tessera::BodyId{body}, pose_of(*position, orientation));
}

void tessera_batch_set_kinematic_target(tessera_batch* batch, uint64_t body, const tessera_position* position,
                                        const double orientation[4]) {
  batch->batch.commands.set_kinematic_target(tessera::BodyId{body}, pose_of(*position, orientation));
}

void tessera_batch_set_servo(tessera_batch* batch, uint64_t joint, double target, double stiffness,
                             double damping) {
  batch->batch.commands.set_drive(
      tessera::JointId{joint},
      {.mode = tessera::DriveMode::kServo, .target = target, .stiffness = stiffness, .damping = damping});
}

void tessera_batch_remove(tessera_batch* batch, uint64_t body) {
  batch->batch.commands.remove(tessera::BodyId{body});
}

void tessera_batch_set_ticks(tessera_batch* batch, uint64_t ticks) { batch->batch.ticks = ticks; }

size_t tessera_batch_ray(tessera_batch* batch, const tessera_position* origin, const double direction[3],
                         double length, uint64_t except) {
  tessera::RayQuery ray{.origin = position_of(*origin), .direction = vector_of(direction), .length = length};
  if (except != 0) ray.except.emplace_back(tessera::BodyId{except});
  const size_t place = batch->batch.queries.size();
  batch->places.rays.emplace(place, batch->batch.queries.ray(ray));
  return place;
}

size_t tessera_batch_states(tessera_batch* batch, const uint64_t* bodies, size_t count) {
  std::vector<tessera::BodyId> ids;
  for (size_t n = 0; n < count; ++n) ids.push_back(tessera::BodyId{bodies[n]});
  const size_t place = batch->batch.queries.size();
  batch->places.states.emplace(place, batch->batch.queries.states(ids));
  return place;
}

tessera_code tessera_run(tessera_client* client, const tessera_batch* batch, double timeout,
                         tessera_answers** answers) {
  return give(client->client->run(batch->batch, duration_of(timeout)), [&](tessera::Answers given) {
    *answers = new tessera_answers{std::move(given), batch->places, {}};
  });
}

tessera_code tessera_send(tessera_client* client, const tessera_batch* batch, tessera_pending** pending) {
  if (client->pending->fetch_add(1) >= TESSERA_PENDING_MAX) {
    client->pending->fetch_sub(1);
    return code_of(absl::ResourceExhaustedError(
        absl::StrCat(TESSERA_PENDING_MAX, " batches have no answer yet, and more must not be sent")));
  }
  const auto promise = std::make_shared<std::promise<absl::StatusOr<tessera::Answers>>>();
  *pending = new tessera_pending{promise->get_future(), batch->places};
  client->client->send(batch->batch,
                       [promise, count = client->pending](absl::StatusOr<tessera::Answers> answers) {
                         count->fetch_sub(1);
                         promise->set_value(std::move(answers));
                       });
  return code_of(absl::OkStatus());
}

tessera_code tessera_take(tessera_pending* pending, double timeout, tessera_answers** answers) {
  if (!pending->answers.valid())
    return code_of(absl::FailedPreconditionError("the answers to this batch were given before"));
  const auto patience = absl::ToChronoNanoseconds(std::min(duration_of(timeout), kForever));
  if (pending->answers.wait_for(patience) != std::future_status::ready)
    return code_of(absl::DeadlineExceededError("the answers are not there yet"));
  return give(pending->answers.get(), [&](tessera::Answers given) {
    *answers = new tessera_answers{std::move(given), std::move(pending->places), {}};
  });
}

void tessera_pending_free(tessera_pending* pending) { delete pending; }

void tessera_answers_free(tessera_answers* answers) { delete answers; }

uint64_t tessera_answers_tick(const tessera_answers* answers) { return answers->answers.tick(); }

uint64_t tessera_answers_effect(const tessera_answers* answers) { return answers->answers.applied().tick; }

tessera_code tessera_answers_ray(const tessera_answers* answers, size_t place, tessera_hit* hit) {
  const auto ray = answers->places.rays.find(place);
  if (ray == answers->places.rays.end()) return no_such_result(place);
  const std::vector<tessera::RayResult> hits = answers->answers[ray->second];
  *hit = hits.empty() ? tessera_hit{} : hit_for_c(hits.front());
  return code_of(absl::OkStatus());
}

tessera_code tessera_answers_states(const tessera_answers* answers, size_t place, tessera_body* bodies,
                                    size_t capacity, size_t* count) {
  const auto states = answers->places.states.find(place);
  if (states == answers->places.states.end()) return no_such_result(place);
  const std::vector<tessera::BodySample> found = answers->answers[states->second];
  *count = found.size();
  std::transform(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(std::min(capacity, found.size())),
                 bodies, body_for_c);
  return code_of(absl::OkStatus());
}

const char* tessera_answers_json(tessera_answers* answers) {
  if (answers->json.empty()) answers->json = to_json(answers->answers);
  return answers->json.c_str();
}
