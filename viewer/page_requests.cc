#include "viewer/page_requests.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <string>
#include <utility>

#include "lpss/model/frame_motion.h"
#include "viewer/ground_request.h"
#include "viewer/json.h"
#include "viewer/model_requests.h"
#include "viewer/places.h"
#include "viewer/world_requests.h"

namespace tessera::viewer {
namespace {

using nlohmann::json;

constexpr std::uint64_t kStepTicksMax = 10'000;
constexpr std::size_t kPlacesMax = 200;

absl::StatusOr<json> tick_of(const absl::StatusOr<Tick>& tick) {
  if (!tick.ok()) return tick.status();
  return json{{"tick", *tick}};
}

absl::StatusOr<BodyName> body_of(const json& body) {
  if (body.is_string()) return body.get<std::string>();
  const absl::StatusOr<std::uint64_t> id = natural_from(body);
  if (!id.ok()) return absl::InvalidArgumentError(absl::StrCat("body: ", id.status().message()));
  return BodyId{*id};
}

absl::StatusOr<json> resume(Client& client, const json& request) {
  return tick_of(client.resume(request.value("real_time_factor", 1.0), kRequestTimeout));
}

absl::StatusOr<json> step(Client& client, const json& request) {
  const absl::StatusOr<std::uint64_t> ticks = natural_from(request.value("ticks", json(1)));
  if (!ticks.ok()) return absl::InvalidArgumentError(absl::StrCat("ticks: ", ticks.status().message()));
  if (*ticks == 0 || *ticks > kStepTicksMax) {
    return absl::InvalidArgumentError(absl::StrCat("ticks: ", *ticks, " is not 1 to ", kStepTicksMax));
  }
  return tick_of(client.step(*ticks));
}

absl::StatusOr<Shape> shape_from(const json& request) {
  const std::string kind = request.at("kind").get<std::string>();
  if (kind == "sphere") return sphere(request.at("radius").get<double>());
  if (kind == "capsule")
    return capsule(request.at("radius").get<double>(), request.at("length").get<double>());
  if (kind == "cylinder")
    return cylinder(request.at("radius").get<double>(), request.at("length").get<double>());
  if (kind != "box") return absl::InvalidArgumentError(absl::StrCat("kind: unknown shape '", kind, "'"));
  const absl::StatusOr<Eigen::Vector3d> size = vector_from(request.at("size"));
  if (!size.ok()) return size.status();
  return box(size->x(), size->y(), size->z());
}

absl::StatusOr<BodyFrame> one_frame(Client& client, const BodyFilter& filter) {
  const absl::StatusOr<std::unique_ptr<BodyStream>> stream = client.watch_bodies(filter, kRequestTimeout);
  if (!stream.ok()) return stream.status();
  return (*stream)->next(kRequestTimeout);
}

// A body where it is in its frame, and the turn from the axes of that to those of another one.
struct Aboard {
  WorldPose pose;
  Eigen::Quaterniond axes = Eigen::Quaterniond::Identity();
};

absl::StatusOr<FoundBody> named_or_numbered(Client& client, const BodyName& name) {
  if (const auto* text = std::get_if<std::string>(&name)) return client.find(*text, kRequestTimeout);
  BodyQuery query;
  query.ids = {std::get<BodyId>(name)};
  absl::StatusOr<FoundBodies> found = client.find_bodies(query, kRequestTimeout);
  if (!found.ok()) return found.status();
  if (found->bodies.empty())
    return absl::NotFoundError(absl::StrCat("no body has the id ", query.ids[0].value));
  return std::move(found->bodies.front());
}

// A body as it is now, in one frame of a stream with `others`.
struct BodyNow {
  FoundBody body;
  BodySample sample;
  BodyFrame frame;
};

absl::StatusOr<BodyNow> look_at(Client& client, const BodyName& name, std::vector<BodyId> others = {}) {
  absl::StatusOr<FoundBody> body = named_or_numbered(client, name);
  if (!body.ok()) return body.status();
  others.push_back(body->id);
  absl::StatusOr<BodyFrame> seen = one_frame(client, {.ids = std::move(others)});
  if (!seen.ok()) return seen.status();
  const auto sample = std::ranges::find(seen->bodies, body->id, &BodySample::id);
  if (sample == seen->bodies.end())
    return absl::NotFoundError(absl::StrCat("no server reports the position of ", body->name));
  const BodySample found = *sample;
  return BodyNow{*std::move(body), found, *std::move(seen)};
}

absl::StatusOr<Aboard> aboard(Client& client, const WorldSettings& settings, const BodyName& name,
                              FrameNumber seen_from = kWorldFrame) {
  std::vector<BodyId> carrying;
  for (const MovingFrame& frame : settings.frames) {
    if (frame.carrier) carrying.push_back(frame.carrier->body);
  }
  const absl::StatusOr<BodyNow> now = look_at(client, name, std::move(carrying));
  if (!now.ok()) return now.status();
  SeenCarriers carriers(settings);
  for (const BodySample& one : now->frame.bodies) carriers.see(one.id, one.pose);
  const WorldPose& pose = now->sample.pose;
  const WorldPose origin{{{0, 0, 0, pose.position.sector.frame}, Eigen::Vector3d::Zero()}};
  const absl::StatusOr<WorldPose> outside =
      pose_in_frame(settings, static_cast<double>(now->frame.tick) * settings.time_step, origin, seen_from,
                    carriers.poses());
  if (!outside.ok()) return outside.status();
  return Aboard{pose, outside->orientation};
}

// Where a body is to be: at a position of the world, or away from another body, m along the axes of that, in
// the frame of that.
absl::StatusOr<WorldPosition> place_from(Client& client, const WorldSettings& settings, const json& request) {
  if (!request.contains("beside")) {
    const absl::StatusOr<WorldPosition> given = position_from(request);
    return given.ok() ? canonical(given->sector, given->local, settings.sector_size) : given;
  }
  const absl::StatusOr<BodyName> name = body_of(request.at("beside"));
  if (!name.ok()) return name.status();
  const absl::StatusOr<Eigen::Vector3d> away = vector_from(request.at("away"));
  if (!away.ok()) return away.status();
  const absl::StatusOr<Aboard> body = aboard(client, settings, *name);
  if (!body.ok()) return body.status();
  const WorldPosition& from = body->pose.position;
  return canonical(from.sector, from.local + body->pose.orientation * *away, settings.sector_size);
}

absl::StatusOr<json> spawn(Client& client, const WorldSettings& settings, const json& request) {
  const absl::StatusOr<WorldPosition> position = place_from(client, settings, request);
  if (!position.ok()) return position.status();
  const absl::StatusOr<Shape> shape = shape_from(request.at("shape"));
  if (!shape.ok()) return shape.status();
  const absl::StatusOr<Spawned> spawned = client.spawn(
      solid(request.value("name", ""), *shape, request.at("mass").get<double>(), *position), kRequestTimeout);
  if (!spawned.ok()) return spawned.status();
  return json{{"body", spawned->id.value}, {"tick", spawned->tick}};
}

// Along the axes of the frame that it is seen from, whatever frame the body is in.
absl::StatusOr<json> push(Client& client, const WorldSettings& settings, const json& request) {
  absl::StatusOr<Eigen::Vector3d> impulse = vector_from(request.at("impulse"));
  if (!impulse.ok()) return impulse.status();
  absl::StatusOr<Eigen::Vector3d> lever = vector_from(request.at("lever"));
  if (!lever.ok()) return lever.status();
  const absl::StatusOr<BodyName> body = body_of(request.at("body"));
  if (!body.ok()) return body.status();
  const absl::StatusOr<FrameNumber> frame = frame_from(request);
  if (!frame.ok()) return frame.status();
  if (!settings.frames.empty()) {
    const absl::StatusOr<Aboard> pushed = aboard(client, settings, *body, *frame);
    if (!pushed.ok()) return pushed.status();
    const Eigen::Quaterniond back = pushed->axes.conjugate();
    impulse = back * *impulse;
    lever = back * *lever;
  }
  return tick_of(client.apply_impulse(*body, *impulse, *lever, kRequestTimeout));
}

absl::StatusOr<json> pick(Client& client, const json& request) {
  const absl::StatusOr<WorldPosition> origin = position_from(request);
  if (!origin.ok()) return origin.status();
  const absl::StatusOr<Eigen::Vector3d> direction = vector_from(request.at("direction"));
  if (!direction.ok()) return direction.status();
  const RayQuery ray{*origin, *direction, request.at("length").get<double>(), 0};
  const absl::StatusOr<std::optional<RayResult>> hit = client.raycast(ray, kRequestTimeout);
  if (!hit.ok()) return hit.status();
  if (!*hit) return json{{"hit", false}};
  json found = to_json((*hit)->position);
  found.update({{"hit", true},
                {"body", (*hit)->body.value},
                {"name", (*hit)->name},
                {"distance", (*hit)->distance},
                {"normal", to_json((*hit)->normal)}});
  return found;
}

// Where a body is in its frame.
absl::StatusOr<json> find(Client& client, const json& request) {
  const absl::StatusOr<BodyName> name = body_of(request.at("body"));
  if (!name.ok()) return name.status();
  const absl::StatusOr<BodyNow> now = look_at(client, *name);
  if (!now.ok()) return now.status();
  json found = to_json(now->sample.pose.position);
  found.update({{"body", now->body.id.value}, {"name", now->body.name}});
  return found;
}

// The body as it could be spawned again; nothing where more hangs on it than that would bring back: joints,
// programs, frames, an owner.
std::optional<NewBody> copy_of(Client& client, const FoundBody& body) {
  if (body.properties.motion != Motion::kDynamic || !body.owner.empty()) return std::nullopt;
  QueryList queries;
  const auto with_shape = queries.find_bodies({.ids = {body.id}, .with_shapes = true});
  const auto programs = queries.programs({.ids = {body.id}});
  const auto joints = queries.find_joints("");
  const auto frames = queries.find_frames("");
  const absl::StatusOr<Answers> answers = client.ask(queries, kRequestTimeout);
  const absl::StatusOr<BodyFrame> frame = one_frame(client, {.ids = {body.id}});
  if (!answers.ok() || !frame.ok() || frame->bodies.empty()) return std::nullopt;
  const FoundBodies found = (*answers)[with_shape];
  const FoundPrograms found_programs = (*answers)[programs];
  const FoundJoints found_joints = (*answers)[joints];
  const FoundFrames found_frames = (*answers)[frames];
  const auto shape = found.shapes.find(body.properties.shape);
  const bool is_alone =
      found_programs.programs.empty() && !found_joints.truncated && !found_frames.truncated &&
      std::ranges::none_of(
          found_joints.joints,
          [&](const FoundJoint& joint) { return joint.parent == body.name || joint.child == body.name; }) &&
      std::ranges::none_of(found_frames.frames, [&](const FoundFrame& held) { return held.body == body.id; });
  if (!is_alone || shape == found.shapes.end()) return std::nullopt;
  const BodySample& sample = frame->bodies.front();
  NewBody copy;
  copy.body = {body.name,     body.properties, sample.pose, sample.linear_velocity, sample.angular_velocity,
               body.user_data};
  copy.shape = shape->second;
  return copy;
}

absl::StatusOr<json> remove(const RequestContext& context, const json& request) {
  const absl::StatusOr<BodyName> name = body_of(request.at("body"));
  if (!name.ok()) return name.status();
  const absl::StatusOr<FoundBody> body = named_or_numbered(context.client, *name);
  if (!body.ok()) return body.status();
  std::optional<NewBody> copy = copy_of(context.client, *body);
  const absl::StatusOr<Tick> tick = context.client.remove(body->id, kRequestTimeout);
  if (!tick.ok()) return tick.status();
  context.removed = std::move(copy);
  return json{{"tick", *tick}, {"name", body->name}, {"can_undo", context.removed.has_value()}};
}

// The body that was removed last, where it was, under a new id.
absl::StatusOr<json> undo(const RequestContext& context) {
  if (!context.removed) return absl::FailedPreconditionError("there is nothing to undo");
  const absl::StatusOr<Spawned> spawned = context.client.spawn(*context.removed, kRequestTimeout);
  if (!spawned.ok()) return spawned.status();
  context.removed.reset();
  return json{{"body", spawned->id.value}, {"tick", spawned->tick}};
}

absl::StatusOr<json> places(Client& client, const WorldSettings& settings) {
  const absl::StatusOr<BodyFrame> seen = one_frame(client, {});
  if (!seen.ok()) return seen.status();
  std::vector<Place> found = places_of(seen->bodies, settings.sector_size);
  const bool truncated = found.size() > kPlacesMax;
  if (truncated) found.resize(kPlacesMax);
  BodyQuery query;
  for (const Place& place : found) query.ids.push_back(place.first);
  query.limit = kPlacesMax;
  absl::StatusOr<FoundBodies> first;
  if (!query.ids.empty()) first = client.find_bodies(query, kRequestTimeout);
  if (!query.ids.empty() && !first.ok()) return first.status();
  json described = json::array();
  for (const Place& place : found) {
    json entry = to_json(place.centre);
    const auto named = std::find_if(first->bodies.begin(), first->bodies.end(),
                                    [&](const FoundBody& body) { return body.id == place.first; });
    entry.update({{"half", place.half},
                  {"bodies", place.bodies},
                  {"sectors", place.sectors},
                  {"name", named == first->bodies.end() ? "" : named->name}});
    if (const FrameNumber frame = place.centre.sector.frame;
        frame != kWorldFrame && frame <= settings.frames.size())
      entry["frame_name"] = settings.frames[frame - 1].name;
    described.push_back(std::move(entry));
  }
  return json{{"places", std::move(described)}, {"truncated", truncated}};
}

absl::StatusOr<json> carry_out(const RequestContext& context, const json& request) {
  const auto& [client, report, options, removed] = context;
  const std::string what = request.at("do").get<std::string>();
  const WorldSettings settings = report.cluster.settings.value_or(WorldSettings{});
  if (what == "pick") return pick(client, request);
  if (what == "find") return find(client, request);
  if (what == "places") return places(client, settings);
  if (what == "ground") return ground(client, report, request);
  if (what == "programs") return programs(client, request);
  if (what == "names") return names(client, request);
  if (what == "search") return search(client, request);
  if (what == "model") return model(client, request);
  if (options.read_only) return absl::PermissionDeniedError(absl::StrCat(what, ": this web UI is read-only"));
  if (what == "pause") return tick_of(client.pause(kRequestTimeout));
  if (what == "resume") return resume(client, request);
  if (what == "step") return step(client, request);
  if (what == "spawn") return spawn(client, settings, request);
  if (what == "push") return push(client, settings, request);
  if (what == "remove") return remove(context, request);
  if (what == "undo") return undo(context);
  if (what == "drive") return drive(client, request);
  if (what == "save") return save(client, options, request);
  if (what == "record") return record(options, request);
  if (what == "stop_recording") return stop_recording(options);
  if (what == "worlds") return worlds(options);
  if (what == "load" || what == "reset" || what == "restore") {
    if (!options.may_load)
      return absl::PermissionDeniedError(absl::StrCat(what, ": needs a token of role admin"));
    removed.reset();
    if (what == "load") return load(client, options, request);
    return what == "reset" ? reset(client, report, options) : restore(client, options, request);
  }
  return absl::InvalidArgumentError(absl::StrCat("do: unknown request '", what, "'"));
}

}  // namespace

json answer(const RequestContext& context, const json& request) {
  try {
    absl::StatusOr<json> done = carry_out(context, request);
    if (done.ok()) return *std::move(done);
    return {{"error", std::string(done.status().message())}};
  } catch (const json::exception& error) {
    return {{"error", absl::StrCat("cannot parse the request: ", error.what())}};
  }
}

}  // namespace tessera::viewer
