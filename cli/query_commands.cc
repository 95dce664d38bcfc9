// Questions to a running world: hash, raycast, near, find, watch.
#include <absl/strings/str_format.h>

#include <utility>

#include "cli/connection.h"
#include "cli/interrupt.h"
#include "cli/terminal.h"
#include "cli/text.h"
#include "client_sdk/arguments/parse.h"

namespace tessera::cli {
namespace {

// The place of the frame among those of the world that move, for a position in one.
nlohmann::json to_json(const WorldPosition& position) {
  nlohmann::json json{{"sector", {position.sector.i, position.sector.j, position.sector.k}},
                      {"local", {position.local.x(), position.local.y(), position.local.z()}}};
  if (position.sector.frame != kWorldFrame) json["frame"] = position.sector.frame;
  return json;
}

constexpr absl::Duration kPollTime = absl::Milliseconds(250);  // so that Ctrl-C is noticed

void add_hash(CLI::App& app, Action& action) {
  CLI::App& command = add_command(app, "hash", "Print the hash of the world's state.", "tessera hash");
  on_cluster(command, action, [](Client& client, nlohmann::json& data) -> absl::Status {
    const absl::StatusOr<HashAt> hash = client.hash();
    if (!hash.ok()) return hash.status();
    data = {{"world_hash", hash->hash}, {"program_hash", hash->programs}, {"tick", hash->tick}};
    absl::PrintF("%s at tick %d\n", hash->hash, hash->tick);
    if (!hash->programs.empty()) absl::PrintF("%s of programs\n", hash->programs);
    return absl::OkStatus();
  });
}

void add_raycast(CLI::App& app, Action& action) {
  CLI::App& command =
      add_command(app, "raycast", "Cast a ray, and print the first hit.",
                  "tessera raycast --sector 0,0,0 --at 0,0,50 --direction 0,0,-1 --length 100");
  const auto ray = std::make_shared<RayQuery>();
  add_parsed(command, "--at", ray->origin.local, parse_vector, "X,Y,Z: metres from the centre of the sector")
      ->required();
  add_parsed(command, "--sector", ray->origin.sector, parse_sector,
             "I,J,K, or I,J,K,N in the N-th frame that moves; 0,0,0 if not given");
  add_parsed(command, "--direction", ray->direction, parse_vector, "X,Y,Z, of any length but zero")
      ->required();
  command.add_option("--length", ray->length, "m")->capture_default_str();
  on_cluster(command, action, [ray](Client& client, nlohmann::json& data) -> absl::Status {
    const absl::StatusOr<std::optional<RayResult>> result = client.raycast(*ray);
    if (!result.ok()) return result.status();
    data["hit"] = result->has_value();
    if (!*result) {
      absl::PrintF("nothing\n");
      return absl::OkStatus();
    }
    const RayResult& hit = **result;
    data["body"] = hit.body.value;
    data["name"] = hit.name;
    data["distance"] = hit.distance;
    data["position"] = to_json(hit.position);
    data["normal"] = {hit.normal.x(), hit.normal.y(), hit.normal.z()};
    absl::PrintF("%s (body %d) at %.6g m: %s + (%s) m, normal (%s)\n", hit.name, hit.body.value, hit.distance,
                 to_string(hit.position.sector), to_string(hit.position.local), to_string(hit.normal));
    return absl::OkStatus();
  });
}

void add_near(CLI::App& app, Action& action) {
  CLI::App& command = add_command(app, "near", "List bodies that overlap a shape or are near it.",
                                  "tessera near --at 0,0,1 --reach 5 --limit 10");
  const auto query = std::make_shared<NearQuery>();
  add_parsed(command, "--at", query->pose.position.local, parse_vector,
             "X,Y,Z: metres from the centre of the sector")
      ->required();
  add_parsed(command, "--sector", query->pose.position.sector, parse_sector,
             "I,J,K, or I,J,K,N in the N-th frame that moves; 0,0,0 if not given");
  const auto probe = std::make_shared<Shape>();
  add_parsed(command, "--shape", *probe, parse_shape, "as for spawn; a point if not given");
  command.add_option("--reach", query->reach, "m, up to 4 sectors; 0: what overlaps")->capture_default_str();
  command.add_option("--limit", query->limit, "how many at most; 0: 1000");
  on_cluster(command, action, [query, probe](Client& client, nlohmann::json& data) -> absl::Status {
    if (!probe->parts.empty()) query->probe = probe->parts.front().geometry;
    const absl::StatusOr<std::vector<Neighbour>> found = client.near(*query);
    if (!found.ok()) return found.status();
    data["bodies"] = nlohmann::json::array();
    for (const Neighbour& body : *found) {
      data["bodies"].push_back({{"id", body.body.value}, {"name", body.name}, {"distance", body.distance}});
      absl::PrintF("%10.6g m  %s (body %d)\n", body.distance, body.name, body.body.value);
    }
    if (found->empty()) absl::PrintF("nothing\n");
    return absl::OkStatus();
  });
}

struct FindOptions {
  std::string prefix;
  std::uint64_t limit = 0;
};

absl::Status list_frames(Client& client, const FindOptions& options, nlohmann::json& data) {
  const absl::StatusOr<FoundFrames> found = client.find_frames(options.prefix, options.limit);
  if (!found.ok()) return found.status();
  nlohmann::json& frames = data["frames"] = nlohmann::json::array();
  std::vector<std::vector<std::string>> rows = {{"frame", "of body", "at"}};
  for (const FoundFrame& frame : found->frames) {
    const Eigen::Vector3d& p = frame.pose.position;
    frames.push_back({{"name", frame.name}, {"body", frame.body.value}, {"position", {p.x(), p.y(), p.z()}}});
    rows.push_back({frame.name, frame.body_name, absl::StrCat("(", to_string(p), ") m")});
  }
  if (rows.size() > 1)
    absl::PrintF("\n%s%s", table(rows, {false, false, false}), found->truncated ? "and more\n" : "");
  return absl::OkStatus();
}

void add_find(CLI::App& app, Action& action) {
  CLI::App& command = add_command(app, "find", "List bodies and frames by the beginning of their names.",
                                  "tessera find tower_ --limit 20");
  const auto options = std::make_shared<FindOptions>();
  command.add_option("prefix", options->prefix, "beginning of the names; all bodies if not given");
  command.add_option("--limit", options->limit, "how many at most; 0: 1000");
  on_cluster(command, action, [options](Client& client, nlohmann::json& data) -> absl::Status {
    const absl::StatusOr<FoundBodies> found = client.find_bodies(options->prefix, options->limit);
    if (!found.ok()) return found.status();
    std::vector<std::vector<std::string>> rows = {{"id", "name", "motion", "mass"}};
    data = {{"bodies", nlohmann::json::array()}, {"truncated", found->truncated}};
    for (const FoundBody& body : found->bodies) {
      data["bodies"].push_back({{"id", body.id.value}, {"name", body.name}});
      const bool dynamic = body.properties.motion == Motion::kDynamic;
      rows.push_back({absl::StrCat(body.id.value), body.name, name_of(body.properties.motion),
                      dynamic ? absl::StrFormat("%g kg", body.properties.mass) : ""});
    }
    absl::PrintF("%s%s", table(rows, {true, false, false, true}), found->truncated ? "and more\n" : "");
    return list_frames(client, *options, data);
  });
}

struct WatchOptions {
  bool divergences = false;
  std::vector<std::string> bodies;
  bool contacts = false;
  bool programs = false;
  bool persisting = false;
  std::uint32_t mask = 0;
  double impulse_min = 0;
  std::uint64_t bytes_per_second = 0;
  bool awake = false;
  std::uint32_t every = 1;
  std::uint64_t frames = 0;
};

nlohmann::json to_json(const BodyFrame& frame) {
  nlohmann::json bodies = nlohmann::json::array();
  for (const BodySample& body : frame.bodies) {
    const Eigen::Vector3d& v = body.linear_velocity;
    bodies.push_back({{"id", body.id.value},
                      {"position", to_json(body.pose.position)},
                      {"linear_velocity", {v.x(), v.y(), v.z()}},
                      {"asleep", body.asleep}});
  }
  return {{"tick", frame.tick}, {"bodies", std::move(bodies)}};
}

const char* name_of(ContactPhase phase) {
  return phase == ContactPhase::kBegin ? "begin" : phase == ContactPhase::kEnd ? "end" : "on";
}

nlohmann::json to_json(const ContactFrame& frame) {
  nlohmann::json contacts = nlohmann::json::array();
  for (const ContactSample& contact : frame.contacts) {
    contacts.push_back({{"phase", name_of(contact.phase)}, {"a", contact.a.value}, {"b", contact.b.value}});
    if (contact.trigger) contacts.back()["trigger"] = true;
    if (contact.phase == ContactPhase::kEnd || contact.trigger) continue;
    const auto numbers = [](const Eigen::Vector3d& v) { return nlohmann::json{v.x(), v.y(), v.z()}; };
    nlohmann::json& patch = contacts.back();
    patch["position"] = to_json(contact.position);
    patch["normal"] = numbers(contact.normal);
    patch["impulse"] = contact.impulse;
    patch["friction"] = numbers(contact.friction);
    for (const ContactPointSample& point : contact.points) {
      patch["points"].push_back(
          {{"offset", numbers(point.offset)}, {"depth", point.depth}, {"impulse", point.impulse}});
    }
  }
  return {{"tick", frame.tick}, {"contacts", std::move(contacts)}};
}

void print(const BodyFrame& frame) {
  for (const BodySample& body : frame.bodies) {
    absl::PrintF("%d  body %d  %s + (%s) m  %.3f m/s%s\n", frame.tick, body.id.value,
                 to_string(body.pose.position.sector), to_string(body.pose.position.local),
                 body.linear_velocity.norm(), body.asleep ? "  asleep" : "");
  }
}

void print(const ContactFrame& frame) {
  for (const ContactSample& contact : frame.contacts) {
    absl::PrintF("%d  %s  %d-%d", frame.tick, name_of(contact.phase), contact.a.value, contact.b.value);
    if (contact.phase == ContactPhase::kEnd || contact.trigger) {
      absl::PrintF("%s\n", contact.trigger ? "  trigger" : "");
    } else {
      absl::PrintF("  %s + (%s) m  %.4g N s\n", to_string(contact.position.sector),
                   to_string(contact.position.local), contact.impulse);
    }
  }
}

nlohmann::json to_json(const DivergenceFrame& frame) {
  nlohmann::json divergences = nlohmann::json::array();
  for (const Divergence& divergence : frame.divergences) {
    divergences.push_back({{"body", divergence.body.value}, {"what", name_of(divergence.kind)}});
    if (divergence.joint.value != 0) divergences.back()["joint"] = divergence.joint.value;
  }
  return {{"tick", frame.tick}, {"divergences", std::move(divergences)}};
}

void print(const DivergenceFrame& frame) {
  for (const Divergence& divergence : frame.divergences)
    absl::PrintF("%s\n", to_text(NamedDivergence{divergence, "", ""}));
}

nlohmann::json to_json(const ProgramFrame& frame) {
  nlohmann::json programs = nlohmann::json::array();
  for (const ProgramSample& sample : frame.programs) {
    programs.push_back({{"body", sample.body.value},
                        {"program", sample.program},
                        {"kind", sample.kind},
                        {"stopped", sample.stopped},
                        {"values", sample.values}});
  }
  return {{"tick", frame.tick}, {"programs", std::move(programs)}};
}

void print(const ProgramFrame& frame) {
  for (const ProgramSample& sample : frame.programs) {
    absl::PrintF("%d  body %d  program %d  %s%s", frame.tick, sample.body.value, sample.program, sample.kind,
                 sample.stopped ? "  stopped" : "");
    for (const double value : sample.values) absl::PrintF("  %.6g", value);
    absl::PrintF("\n");
  }
}

template <typename Frame>
absl::Status follow(absl::StatusOr<std::unique_ptr<Stream<Frame>>> stream, std::uint64_t frames,
                    nlohmann::json& data) {
  if (!stream.ok()) return stream.status();
  for (std::uint64_t count = 0; (frames == 0 || count < frames) && !interrupted();) {
    const absl::StatusOr<Frame> frame = (*stream)->next(kPollTime);
    if (absl::IsDeadlineExceeded(frame.status())) continue;
    if (!frame.ok()) return frame.status();
    print(*frame);
    // Of a watch without end only the last frame is kept.
    if (frames == 0) data["frames"].clear();
    data["frames"].push_back(to_json(*frame));
    std::fflush(stdout);
    ++count;
  }
  return absl::OkStatus();
}

absl::Status watch(Client& client, const WatchOptions& options, nlohmann::json& data) {
  catch_interrupts();
  std::vector<BodyId> ids;
  for (const std::string& text : options.bodies) {
    const BodyName name = parse_body(text);
    if (const BodyId* id = std::get_if<BodyId>(&name)) {
      ids.push_back(*id);
      continue;
    }
    const absl::StatusOr<FoundBody> found = client.find(text);
    if (!found.ok()) return found.status();
    ids.push_back(found->id);
  }
  if (options.contacts) {
    return follow<ContactFrame>(client.watch_contacts({.ids = ids,
                                                       .persisting = options.persisting,
                                                       .mask = options.mask,
                                                       .impulse_min = options.impulse_min}),
                                options.frames, data);
  }
  if (options.divergences) {
    return follow<DivergenceFrame>(client.watch_divergences(), options.frames, data);
  }
  if (options.programs) {
    return follow<ProgramFrame>(client.watch_programs({.ids = ids, .every_ticks = options.every}),
                                options.frames, data);
  }
  BodyFilter filter;
  filter.ids = ids;
  filter.every_ticks = options.every;
  filter.only_awake = options.awake;
  filter.bytes_per_second = options.bytes_per_second;
  filter.complete = true;
  return follow<BodyFrame>(client.watch_bodies(filter), options.frames, data);
}

void add_watch(CLI::App& app, Action& action) {
  CLI::App& command =
      add_command(app, "watch", "Print bodies, contacts or programs tick by tick until Ctrl-C.",
                  "tessera watch crate --every 60\n  tessera watch --contacts");
  const auto options = std::make_shared<WatchOptions>();
  command.add_option("bodies", options->bodies, "names or ids; all bodies if none is given");
  CLI::Option* contacts = command.add_flag(
      "--contacts", options->contacts, "contacts that begin and end, and what enters and leaves triggers");
  command.add_flag("--persisting", options->persisting, "and those that go on")->needs(contacts);
  command
      .add_option("--mask", options->mask,
                  "only contacts with a body of any of these collision categories, as bits; 0: all")
      ->needs(contacts)
      ->capture_default_str();
  command
      .add_option("--impulse-min", options->impulse_min,
                  "N s; not 0: each pair in every tick in which it has at least that, and no ends")
      ->needs(contacts)
      ->capture_default_str();
  CLI::Option* divergences =
      command.add_flag("--divergences", options->divergences, "bodies that leave all range, and are stopped")
          ->excludes(contacts);
  CLI::Option* programs =
      command
          .add_flag("--programs", options->programs,
                    "the values of programs that change, in the order in which `tessera programs` names them")
          ->excludes(contacts)
          ->excludes(divergences);
  command.add_flag("--awake", options->awake, "only bodies that are awake")
      ->excludes(contacts)
      ->excludes(programs);
  command.add_option("--every", options->every, "ticks between two looks at bodies or programs")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command
      .add_option("--bytes-per-second", options->bytes_per_second,
                  "of all servers together, at most; what is too much is told later; 0: no limit")
      ->excludes(contacts)
      ->excludes(programs)
      ->capture_default_str();
  command.add_option("--frames", options->frames, "end after so many ticks; 0: never");
  on_cluster(command, action,
             [options](Client& client, nlohmann::json& data) { return watch(client, *options, data); });
}

}  // namespace

void add_query_commands(CLI::App& app, Action& action) {
  add_hash(app, action);
  add_raycast(app, action);
  add_near(app, action);
  add_find(app, action);
  add_watch(app, action);
}

}  // namespace tessera::cli
