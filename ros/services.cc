#include "ros/services.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>
#include <absl/strings/strip.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <utility>

#include "worlds/loader/model_file.h"
#include "worlds/loader/world_file.h"

namespace tessera::ros {
namespace {

constexpr absl::Duration kServiceWait = absl::Seconds(10);
// How long a reply waits for a client whose reader is not known yet.
constexpr dds_duration_t kReaderWait = DDS_SECS(1);
constexpr std::uint64_t kStepsMax = 1'000'000;

// Of a Result, and of the services that have more.
enum Code : std::uint8_t {
  kUnsupported = 0,
  kOk = 1,
  kNotFound = 2,
  kIncorrectState = 3,
  kFailed = 4,
  kAlreadyInState = 101,
  kTransitionFailed = 102,
  kPoseOfStateInvalid = 101,
  kNameNotUnique = 101,
  kNameInvalid = 102,
  kUnsupportedFormat = 103,
  kNoResource = 104,
  kNamespaceInvalid = 105,
  kParseError = 106,
  kMissingAssets = 107,
  kPoseInvalid = 109,
};

enum State : std::uint8_t {
  kStopped = 0,
  kPlaying = 1,
  kPaused = 2,
  kQuitting = 3,
  kNoWorld = 4,
  kLoading = 5
};

// Of SimulatorFeatures.
constexpr std::array<std::uint16_t, 15> kFeatures = {
    0,           // SPAWNING
    1,           // DELETING
    8,           // ENTITY_CATEGORIES
    9,           // SPAWNING_RESOURCE_STRING
    10, 11, 12,  // ENTITY_STATE_GETTING, _SETTING, ENTITY_INFO_GETTING
    24, 25, 26,  // SIMULATION_STATE_GETTING, _SETTING, _PAUSE
    31, 32,      // STEP_SIMULATION_SINGLE, _MULTIPLE
    // With a world to load again:
    20, 21, 22,  // SIMULATION_RESET, _TIME, _STATE
};
constexpr std::size_t kResetFeatures = 3;

enum BoundsType : std::uint8_t { kNoBounds = 0, kSphere = 3 };
enum Scope : std::uint8_t { kDefaultScope = 0, kAllScopes = 255 };

std::uint8_t code_of(const absl::Status& status) {
  if (status.ok()) return kOk;
  if (absl::IsNotFound(status)) return kNotFound;
  if (absl::IsUnimplemented(status)) return kUnsupported;
  return absl::IsFailedPrecondition(status) ? kIncorrectState : kFailed;
}

std::uint8_t state_of(const ClusterStatus& status) {
  if (status.state == "running") return kPlaying;
  if (status.state == "paused") return kPaused;
  return status.state == "loading" || status.state == "recovering" ? kLoading : kNoWorld;
}

// INVALID_ARGUMENT for one that is none.
absl::StatusOr<Pose> pose_of(const geometry_msgs_msg_dds__Pose_& message) {
  const auto& [at, to] = message;
  const Pose pose{{at.x, at.y, at.z}, Eigen::Quaterniond(to.w, to.x, to.y, to.z)};
  constexpr double kTolerance = 0.1;
  if (!pose.position.allFinite() || !(std::abs(pose.orientation.norm() - 1) < kTolerance))
    return absl::InvalidArgumentError("the pose must be finite, with a quaternion of length 1");
  return Pose{pose.position, pose.orientation.normalized()};
}

Eigen::Vector3d vector_of(const geometry_msgs_msg_dds__Vector3_& message) {
  return {message.x, message.y, message.z};
}

absl::StatusOr<EntityFilter> filter_of(const simulation_interfaces_msg_dds__EntityFilters_& message) {
  EntityFilter filter;
  filter.pattern = message.filter;
  if (message.categories._length > 0) filter.categories.emplace();
  for (std::uint32_t n = 0; n < message.categories._length; ++n)
    filter.categories->insert(message.categories._buffer[n].category);
  if (message.tags.tags._length > 0) return absl::UnimplementedError("entities have no tags");
  if (message.bounds.type == kNoBounds) return filter;
  const auto& points = message.bounds.points;
  if (message.bounds.type != kSphere) return absl::UnimplementedError("bounds must be a sphere");
  if (points._length != 2) return absl::InvalidArgumentError("a sphere must have 2 points");
  filter.within = {vector_of(points._buffer[0]), points._buffer[1].x};
  if (!filter.within->centre.allFinite() || !(filter.within->radius > 0))
    return absl::InvalidArgumentError("the centre of a sphere must be finite, and its radius above 0");
  return filter;
}

}  // namespace

using StateMessage = simulation_interfaces_msg_dds__EntityState_;

class Services::Texts {
 public:
  char* keep(std::string text) { return texts_.emplace_back(std::move(text)).data(); }
  // A sequence of texts.
  dds_sequence_string keep_all(const std::vector<std::string>& texts) {
    std::vector<char*>& all = lists_.emplace_back();
    for (const std::string& one : texts) all.push_back(keep(one));
    const auto count = static_cast<std::uint32_t>(all.size());
    return {count, count, all.data(), /*_release=*/false};
  }
  std::vector<StateMessage>& states() { return states_; }

 private:
  std::vector<StateMessage> states_;
  std::deque<std::string> texts_;
  std::deque<std::vector<char*>> lists_;
};

Services::Result Services::result_of(const absl::Status& status, Texts& texts) {
  return {code_of(status), texts.keep(std::string(status.message()))};
}

simulation_interfaces_msg_dds__EntityState_ Services::message_of(const EntityState& state,
                                                                 Texts& texts) const {
  const auto& [position, orientation] = state.pose;
  const Eigen::Vector3d& velocity = state.velocity;
  const Eigen::Vector3d& spin = state.angular_velocity;
  StateMessage message{};
  message.header.frame_id = texts.keep(options_.frame);
  message.pose = {{position.x(), position.y(), position.z()},
                  {orientation.x(), orientation.y(), orientation.z(), orientation.w()}};
  message.twist = {{velocity.x(), velocity.y(), velocity.z()}, {spin.x(), spin.y(), spin.z()}};
  return message;
}

absl::StatusOr<std::unique_ptr<Services>> Services::open(Client& client, Node& node,
                                                         const ServiceOptions& options) {
  std::unique_ptr<Services> services(new Services(client, options));
  absl::Status status = services->add_entities(node);
  status.Update(services->add_time(node));
  if (!status.ok()) return status;
  services->thread_ = std::thread([all = services.get()] { all->run(); });
  return services;
}

Services::Services(Client& client, const ServiceOptions& options)
    : client_(client), options_(options), entities_(client, options.sector) {}

Services::~Services() {
  // No request comes from here on.
  for (const ServiceEnds& ends : ends_) dds_delete(ends.requests);
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  for (const ServiceEnds& ends : ends_) dds_delete(ends.replies);
}

void Services::run() {
  std::unique_lock lock(mutex_);
  while (!closing_) {
    changed_.wait(lock, [&] { return closing_ || has_requests_; });
    if (closing_) return;
    has_requests_ = false;
    lock.unlock();
    for (const std::function<void()>& answer : services_) answer();
    lock.lock();
  }
}

template <typename Request, typename Reply, typename Handle>
absl::Status Services::add(Node& node, const char* name, const dds_topic_descriptor_t& request,
                           const dds_topic_descriptor_t& reply, Handle handle) {
  const auto on_request = [this] {
    const std::lock_guard lock(mutex_);
    has_requests_ = true;
    changed_.notify_all();
  };
  const std::string full = absl::StrCat("/", name);
  const absl::StatusOr<ServiceEnds> ends = node.service(request, reply, full, on_request);
  if (!ends.ok()) return ends.status();
  ends_.push_back(*ends);
  services_.emplace_back([=] {
    take_all<Request>(ends->requests, [&](const Request& asked) {
      Texts texts;
      Reply answer{};
      answer.client = asked.client;
      answer.number = asked.number;
      handle(asked, answer, texts);
      await_reader(ends->replies, kReaderWait);
      warn(write(ends->replies, &answer, full));
    });
  });
  return absl::OkStatus();
}

absl::Status Services::check_frame(const char* frame) const {
  const absl::string_view name = absl::StripPrefix(frame, "/");
  if (name.empty() || name == "world" || name == options_.frame) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("poses must be in the frame \"", options_.frame, "\", not in \"", name, "\""));
}

absl::Status Services::set_state(const simulation_interfaces_srv_dds__SetEntityState_Request_& request) {
  if (absl::Status status = check_frame(request.state.header.frame_id); !status.ok()) return status;
  std::optional<Pose> pose;
  if (request.set_pose) {
    const absl::StatusOr<Pose> given = pose_of(request.state.pose);
    if (!given.ok()) return given.status();
    pose = *given;
  }
  std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>> velocities;
  if (request.set_twist)
    velocities.emplace(vector_of(request.state.twist.linear), vector_of(request.state.twist.angular));
  return entities_.place(request.entity, pose, velocities);
}

absl::StatusOr<std::string> Services::spawn(
    const simulation_interfaces_srv_dds__SpawnEntity_Request_& request, Result& result, Texts& texts) {
  const auto fail = [&](std::uint8_t code, const absl::Status& status) {
    result = {code, texts.keep(std::string(status.message()))};
    return status;
  };
  const std::string name = request.name;
  const std::string name_space = request.entity_namespace;
  if (!name_space.empty() && absl::StripPrefix(name_space, "/") != name) {
    return fail(kNamespaceInvalid,
                absl::InvalidArgumentError("the namespace of an entity is its name: give none, or that"));
  }
  const std::string text = request.entity_resource.resource_string;
  const std::string file(absl::StripPrefix(request.entity_resource.uri, "file://"));
  if (text.empty() && file.empty())
    return fail(kNoResource, absl::InvalidArgumentError("the request has neither a URI nor a resource"));
  if (text.empty() && absl::StrContains(file, "://"))
    return fail(kUnsupportedFormat, absl::InvalidArgumentError("a URI must be that of a file"));
  absl::Status status = check_frame(request.initial_pose.header.frame_id);
  const absl::StatusOr<Pose> pose = pose_of(request.initial_pose.pose);
  status.Update(pose.status());
  if (!status.ok()) return fail(kPoseInvalid, status);
  absl::StatusOr<WorldDescription> model = text.empty() ? load_model_file(file) : load_model_string(text);
  if (!model.ok())
    return fail(absl::IsNotFound(model.status()) ? kMissingAssets : kParseError, model.status());
  absl::StatusOr<std::string> spawned =
      entities_.spawn(*std::move(model), name, request.allow_renaming, *pose);
  if (spawned.ok()) return spawned;
  if (absl::IsAlreadyExists(spawned.status())) return fail(kNameNotUnique, spawned.status());
  if (absl::IsInvalidArgument(spawned.status())) return fail(kNameInvalid, spawned.status());
  return fail(code_of(spawned.status()), spawned.status());
}

void Services::change_state(std::uint8_t wanted, Result& result, Texts& texts) {
  const auto end = [&](std::uint8_t code, absl::string_view why) {
    result = {code, texts.keep(std::string(why))};
  };
  if (wanted != kPlaying && wanted != kPaused)
    return end(kUnsupported, "a world can be played and paused; it is not stopped, and does not quit");
  const absl::StatusOr<ClusterStatus> status = client_.status(kServiceWait);
  if (!status.ok()) return end(kTransitionFailed, status.status().message());
  const std::uint8_t now = state_of(*status);
  if (now == wanted) return end(kAlreadyInState, "it is in this state already");
  if (now != kPlaying && now != kPaused) return end(kIncorrectState, "the cluster has no world");
  const absl::Status done =
      wanted == kPlaying ? client_.resume(1, kServiceWait).status() : client_.pause(kServiceWait).status();
  end(done.ok() ? kOk : kTransitionFailed, done.message());
}

absl::Status Services::step(std::uint64_t steps) {
  if (steps == 0 || steps > kStepsMax)
    return absl::OutOfRangeError(absl::StrCat("steps = ", steps, " must be 1 to ", kStepsMax));
  const absl::StatusOr<ClusterStatus> status = client_.status(kServiceWait);
  if (!status.ok()) return status.status();
  if (state_of(*status) != kPaused) return absl::AbortedError("the world must be paused");
  return client_.step(steps).status();
}

void Services::reset(std::uint8_t scope, Result& result, Texts& texts) {
  const auto end = [&](std::uint8_t code, absl::string_view why) {
    result = {code, texts.keep(std::string(why))};
  };
  if (options_.world.empty())
    return end(kUnsupported, "there is no world to load again: start tessera-ros with --world FILE");
  if (scope != kDefaultScope && scope != kAllScopes)
    return end(kUnsupported, "a reset loads the whole world again: its scope must be that of all");
  const absl::StatusOr<ClusterStatus> status = client_.status(kServiceWait);
  if (!status.ok()) return end(kFailed, status.status().message());
  const absl::StatusOr<LoadedWorld> loaded = load_world_file(options_.world);
  if (!loaded.ok()) return end(kFailed, loaded.status().message());
  absl::Status done = client_.load(loaded->world, /*replace=*/true).status();
  if (done.ok() && state_of(*status) == kPlaying) done = client_.resume(1, kServiceWait).status();
  end(done.ok() ? kOk : kFailed, done.message());
}

// A service by its name in ROS, and by its type.
#define TESSERA_SERVICE(name, type, ...)                                                                    \
  add<simulation_interfaces_srv_dds__##type##_Request_, simulation_interfaces_srv_dds__##type##_Response_>( \
      node, name, simulation_interfaces_srv_dds__##type##_Request__desc,                                    \
      simulation_interfaces_srv_dds__##type##_Response__desc, __VA_ARGS__)

absl::Status Services::add_entities(Node& node) {
  absl::Status status;
  status.Update(
      TESSERA_SERVICE("get_entities", GetEntities, [this](const auto& request, auto& reply, Texts& texts) {
        const absl::StatusOr<EntityFilter> filter = filter_of(request.filters);
        const absl::StatusOr<std::vector<std::string>> names =
            filter.ok() ? entities_.names(*filter) : filter.status();
        reply.result = result_of(names.status(), texts);
        if (names.ok()) reply.entities = texts.keep_all(*names);
      }));
  status.Update(TESSERA_SERVICE(
      "get_entities_states", GetEntitiesStates, [this](const auto& request, auto& reply, Texts& texts) {
        const absl::StatusOr<EntityFilter> filter = filter_of(request.filters);
        const absl::StatusOr<std::vector<std::pair<std::string, EntityState>>> states =
            filter.ok() ? entities_.states(*filter) : filter.status();
        reply.result = result_of(states.status(), texts);
        if (!states.ok()) return;
        std::vector<std::string> names;
        std::vector<StateMessage>& messages = texts.states();
        for (const auto& [name, state] : *states) {
          names.push_back(name);
          messages.push_back(message_of(state, texts));
        }
        const auto count = static_cast<std::uint32_t>(messages.size());
        reply.entities = texts.keep_all(names);
        reply.states = {count, count, messages.data(), /*_release=*/false};
      }));
  status.Update(TESSERA_SERVICE("get_entity_state", GetEntityState,
                                [this](const auto& request, auto& reply, Texts& texts) {
                                  const absl::StatusOr<EntityState> state = entities_.state(request.entity);
                                  reply.result = result_of(state.status(), texts);
                                  reply.state = message_of(state.value_or(EntityState{}), texts);
                                }));
  status.Update(TESSERA_SERVICE(
      "get_entity_info", GetEntityInfo, [this](const auto& request, auto& reply, Texts& texts) {
        const absl::StatusOr<std::uint8_t> category = entities_.category(request.entity);
        reply.result = result_of(category.status(), texts);
        reply.info.category.category = category.value_or(kDynamicObject);
        reply.info.description = texts.keep("");
      }));
  status.Update(TESSERA_SERVICE("set_entity_state", SetEntityState,
                                [this](const auto& request, auto& reply, Texts& texts) {
                                  const absl::Status done = set_state(request);
                                  reply.result = result_of(done, texts);
                                  if (absl::IsInvalidArgument(done) || absl::IsOutOfRange(done))
                                    reply.result.result = kPoseOfStateInvalid;
                                }));
  status.Update(
      TESSERA_SERVICE("spawn_entity", SpawnEntity, [this](const auto& request, auto& reply, Texts& texts) {
        reply.result = result_of(absl::OkStatus(), texts);
        reply.entity_name = texts.keep(spawn(request, reply.result, texts).value_or(""));
      }));
  status.Update(
      TESSERA_SERVICE("delete_entity", DeleteEntity, [this](const auto& request, auto& reply, Texts& texts) {
        reply.result = result_of(entities_.remove(request.entity), texts);
      }));
  return status;
}

absl::Status Services::add_time(Node& node) {
  absl::Status status;
  status.Update(TESSERA_SERVICE(
      "get_simulator_features", GetSimulatorFeatures, [this](const auto&, auto& reply, Texts& texts) {
        const auto count =
            static_cast<std::uint32_t>(kFeatures.size() - (options_.world.empty() ? kResetFeatures : 0));
        reply.features.features = {count, count, const_cast<std::uint16_t*>(kFeatures.data()),
                                   /*_release=*/false};
        reply.features.spawn_formats = texts.keep_all({"sdf", "urdf"});
        reply.features.custom_info =
            texts.keep("Tessera: entities are models, or bodies by their whole names");
      }));
  status.Update(TESSERA_SERVICE("get_simulation_state", GetSimulationState,
                                [this](const auto&, auto& reply, Texts& texts) {
                                  const absl::StatusOr<ClusterStatus> now = client_.status(kServiceWait);
                                  reply.result = result_of(now.status(), texts);
                                  reply.state.state = now.ok() ? state_of(*now) : std::uint8_t{kNoWorld};
                                }));
  status.Update(TESSERA_SERVICE("set_simulation_state", SetSimulationState,
                                [this](const auto& request, auto& reply, Texts& texts) {
                                  change_state(request.state.state, reply.result, texts);
                                }));
  status.Update(TESSERA_SERVICE("step_simulation", StepSimulation,
                                [this](const auto& request, auto& reply, Texts& texts) {
                                  reply.result = result_of(step(request.steps), texts);
                                }));
  status.Update(TESSERA_SERVICE(
      "reset_simulation", ResetSimulation,
      [this](const auto& request, auto& reply, Texts& texts) { reset(request.scope, reply.result, texts); }));
  return status;
}

#undef TESSERA_SERVICE

}  // namespace tessera::ros
