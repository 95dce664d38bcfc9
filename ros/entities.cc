#include "ros/entities.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <regex.h>

#include <algorithm>
#include <set>

#include "ros/robots.h"
#include "worlds/loader/model_file.h"

namespace tessera::ros {
namespace {

constexpr absl::Duration kEntityWait = absl::Seconds(10);
constexpr std::uint64_t kBodiesAsked = 100'000;  // the coordinator's maximum
constexpr int kRenamingsMax = 10'000;

EntityState state_of(const BodySample& sample, const SectorIndex& sector, double sector_size) {
  return {{relative_to(sample.pose.position, sector, sector_size), sample.pose.orientation},
          sample.linear_velocity,
          sample.angular_velocity};
}

std::uint8_t category_of(const std::vector<FoundBody>& bodies) {
  const bool is_static = std::ranges::all_of(
      bodies, [](const FoundBody& body) { return body.properties.motion == Motion::kStatic; });
  return is_static ? kStaticObject : kDynamicObject;
}

// Keeps those that it finds in their names.
absl::Status keep_matching(const std::string& pattern, std::vector<std::string>& names) {
  if (pattern.empty()) return absl::OkStatus();
  if (pattern.size() > kPatternBytesMax)
    return absl::InvalidArgumentError(
        absl::StrCat("filter: its ", pattern.size(), " bytes must be at most ", kPatternBytesMax));
  regex_t expression;
  if (const int error = regcomp(&expression, pattern.c_str(), REG_EXTENDED | REG_NOSUB); error != 0) {
    std::string why(256, '\0');
    why.resize(regerror(error, &expression, why.data(), why.size()) - 1);
    return absl::InvalidArgumentError(absl::StrCat("filter: ", why));
  }
  const absl::Cleanup free_expression = [&] { regfree(&expression); };
  std::erase_if(
      names, [&](const std::string& name) { return regexec(&expression, name.c_str(), 0, nullptr, 0) != 0; });
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Entities::Place> Entities::place_of_frame() {
  const absl::StatusOr<ClusterStatus> status = client_.status(kEntityWait);
  if (!status.ok()) return status.status();
  if (!status->settings) return absl::FailedPreconditionError("the cluster has no world");
  return Place{sector_.value_or(status->anchor), status->settings->sector_size};
}

absl::StatusOr<Entities::Models> Entities::models() {
  absl::StatusOr<FoundBodies> found = client_.find_bodies("", kBodiesAsked, kEntityWait);
  if (!found.ok()) return found.status();
  if (found->truncated)
    return absl::ResourceExhaustedError(absl::StrCat("the world has more than ", kBodiesAsked, " bodies"));
  Models models;
  for (FoundBody& body : found->bodies) models[model_of(body.name)].push_back(std::move(body));
  return models;
}

absl::StatusOr<std::vector<FoundBody>> Entities::bodies_of(const std::string& entity) {
  if (entity.empty()) return absl::NotFoundError("there is no entity without a name");
  absl::StatusOr<FoundBodies> found = client_.find_bodies(entity, kBodiesAsked, kEntityWait);
  if (!found.ok()) return found.status();
  for (const FoundBody& body : found->bodies) {
    if (body.name == entity) return std::vector{body};
  }
  std::erase_if(found->bodies,
                [&](const FoundBody& body) { return !absl::StartsWith(body.name, entity + "::"); });
  if (found->bodies.empty()) return absl::NotFoundError(absl::StrCat("there is no entity \"", entity, "\""));
  return std::move(found->bodies);
}

absl::StatusOr<std::vector<BodySample>> Entities::samples_of(const std::vector<FoundBody>& bodies) {
  std::vector<BodyId> ids;
  for (const FoundBody& body : bodies) ids.push_back(body.id);
  std::ranges::sort(ids);
  QueryList queries;
  const auto states = queries.states(ids);
  const absl::StatusOr<Answers> answers = client_.ask(queries, kEntityWait);
  if (!answers.ok()) return answers.status();
  std::vector<BodySample> samples = (*answers)[states];
  if (samples.size() != ids.size())
    return absl::UnavailableError("a body of it is not there yet, or no longer: it comes with the next tick");
  return samples;
}

absl::StatusOr<std::vector<std::string>> Entities::names(const EntityFilter& filter) {
  const absl::StatusOr<Place> place = place_of_frame();
  if (!place.ok()) return place.status();
  const absl::StatusOr<Models> all = models();
  if (!all.ok()) return all.status();
  std::set<std::string> names;
  for (const auto& [name, bodies] : *all) {
    if (!filter.categories || filter.categories->contains(category_of(bodies))) names.insert(name);
  }
  if (filter.within) {
    const NearQuery ball{.pose = {{place->sector, filter.within->centre}, Eigen::Quaterniond::Identity()},
                         .probe = Sphere{filter.within->radius},
                         .limit = kBodiesAsked};
    const absl::StatusOr<std::vector<Neighbour>> found = client_.near(ball, kEntityWait);
    if (!found.ok()) return found.status();
    std::set<std::string> near;
    for (const Neighbour& body : *found) near.insert(model_of(body.name));
    std::erase_if(names, [&](const std::string& name) { return !near.contains(name); });
  }
  std::vector<std::string> kept(names.begin(), names.end());
  if (absl::Status status = keep_matching(filter.pattern, kept); !status.ok()) return status;
  return kept;
}

absl::StatusOr<std::vector<std::pair<std::string, EntityState>>> Entities::states(
    const EntityFilter& filter) {
  const absl::StatusOr<std::vector<std::string>> chosen = names(filter);
  if (!chosen.ok()) return chosen.status();
  const absl::StatusOr<Place> place = place_of_frame();
  if (!place.ok()) return place.status();
  absl::StatusOr<Models> all = models();
  if (!all.ok()) return all.status();
  std::vector<FoundBody> firsts;
  std::vector<std::string> found;
  for (const std::string& name : *chosen) {
    const auto model = all->find(name);
    if (model == all->end()) continue;  // it has just been removed
    firsts.push_back(model->second.front());
    found.push_back(name);
  }
  if (firsts.empty()) return std::vector<std::pair<std::string, EntityState>>{};
  const absl::StatusOr<std::vector<BodySample>> samples = samples_of(firsts);
  if (!samples.ok()) return samples.status();
  std::vector<std::pair<std::string, EntityState>> states;
  for (std::size_t n = 0; n < firsts.size(); ++n) {
    const auto sample = std::ranges::find(*samples, firsts[n].id, &BodySample::id);
    states.emplace_back(found[n], state_of(*sample, place->sector, place->sector_size));
  }
  return states;
}

absl::StatusOr<EntityState> Entities::state(const std::string& entity) {
  const absl::StatusOr<Place> place = place_of_frame();
  if (!place.ok()) return place.status();
  const absl::StatusOr<std::vector<FoundBody>> bodies = bodies_of(entity);
  if (!bodies.ok()) return bodies.status();
  const absl::StatusOr<std::vector<BodySample>> samples = samples_of({bodies->front()});
  if (!samples.ok()) return samples.status();
  return state_of(samples->front(), place->sector, place->sector_size);
}

absl::StatusOr<std::uint8_t> Entities::category(const std::string& entity) {
  const absl::StatusOr<std::vector<FoundBody>> bodies = bodies_of(entity);
  if (!bodies.ok()) return bodies.status();
  return category_of(*bodies);
}

absl::Status Entities::place(const std::string& entity, const std::optional<Pose>& pose,
                             const std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& velocities) {
  const absl::StatusOr<Place> place = place_of_frame();
  if (!place.ok()) return place.status();
  const absl::StatusOr<std::vector<FoundBody>> bodies = bodies_of(entity);
  if (!bodies.ok()) return bodies.status();
  const absl::StatusOr<std::vector<BodySample>> samples = samples_of(*bodies);
  if (!samples.ok()) return samples.status();
  const BodySample& first = samples->front();
  const EntityState before = state_of(first, place->sector, place->sector_size);
  const Pose after = pose.value_or(before.pose);
  const Eigen::Quaterniond turn = after.orientation * before.pose.orientation.conjugate();
  std::vector<PlacedBody> placed;
  for (std::size_t n = 0; n < samples->size(); ++n) {
    const BodySample& sample = (*samples)[n];
    // From the first body, without the way from the frame's origin: that may be long.
    const Eigen::Vector3d arm =
        turn * (relative_to(sample.pose.position, first.pose.position.sector, place->sector_size) -
                first.pose.position.local);
    PlacedBody& body = placed.emplace_back();
    body.body = sample.id;
    body.pose = {{place->sector, after.position + arm}, (turn * sample.pose.orientation).normalized()};
    if (!pose) body.pose = sample.pose;
    body.linear_velocity = sample.linear_velocity;
    body.angular_velocity = sample.angular_velocity;
    if (!velocities) continue;
    body.angular_velocity = velocities->second;
    body.linear_velocity = velocities->first + velocities->second.cross(arm);
  }
  CommandList commands;
  commands.set_state(placed);
  return client_.apply(commands, kEntityWait).status();
}

absl::StatusOr<std::string> Entities::spawn(WorldDescription model, std::string name, bool renamed,
                                            const Pose& pose) {
  const absl::StatusOr<Place> place = place_of_frame();
  if (!place.ok()) return place.status();
  if (name.empty()) name = model_name(model);
  const absl::StatusOr<Models> all = models();
  if (!all.ok()) return all.status();
  std::string free = name;
  for (int n = 1; all->contains(free); ++n) {
    if (!renamed || n > kRenamingsMax)
      return absl::AlreadyExistsError(absl::StrCat("there is an entity \"", name, "\" already"));
    free = absl::StrCat(name, "_", n);
  }
  if (absl::Status status = rename_model(free, model); !status.ok()) return status;
  CommandList commands;
  commands.spawn(model, "", WorldPose{{place->sector, pose.position}, pose.orientation});
  if (absl::Status status = client_.apply(commands, kEntityWait).status(); !status.ok()) return status;
  return free;
}

absl::Status Entities::remove(const std::string& entity) {
  const absl::StatusOr<std::vector<FoundBody>> bodies = bodies_of(entity);
  if (!bodies.ok()) return bodies.status();
  CommandList commands;
  if (bodies->size() == 1 && bodies->front().name == entity) {
    commands.remove(bodies->front().id);
  } else {
    commands.remove_all(entity + "::");
  }
  return client_.apply(commands, kEntityWait).status();
}

}  // namespace tessera::ros
