// Bodies of a running world: spawn, remove, velocity, impulse, force, teleport, target.
#include <absl/strings/numbers.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "cli/connection.h"
#include "client_sdk/arguments/parse.h"
#include "worlds/loader/model_file.h"

namespace tessera::cli {
namespace {

struct BodyOptions {
  std::string body;
  std::string name;
  std::string model;  // its file
  bool is_model = false;
  Shape shape = box(1, 1, 1);
  WorldPosition at;
  double mass = 1;
  double friction = 0.5;
  bool fixed = false;
  bool kinematic = false;
  bool trigger = false;
  std::vector<std::string> programs;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();   // linear velocity, impulse, force
  Eigen::Vector3d second = Eigen::Vector3d::Zero();  // angular velocity, lever, torque
};

void add_body_option(CLI::App& command, BodyOptions& options) {
  command.add_option("body", options.body, "its name, or its id")->required();
}

void add_position_options(CLI::App& command, BodyOptions& options) {
  add_parsed(command, "--at", options.at.local, parse_vector, "X,Y,Z: metres from the centre of the sector");
  add_parsed(command, "--sector", options.at.sector, parse_sector,
             "I,J,K, or I,J,K,N in the N-th frame that moves; 0,0,0 if not given");
}

absl::Status spawn_body(const BodyOptions& options, Client& client, nlohmann::json& data) {
  NewBody body = solid(options.name, options.shape, options.mass, options.at);
  BodyProperties& properties = body.body.properties;
  if (options.fixed) properties.motion = Motion::kStatic;
  if (options.kinematic) properties.motion = Motion::kKinematic;
  if (properties.motion != Motion::kDynamic) properties.inertia = {1, 1, 1};
  properties.friction = options.friction;
  properties.trigger = options.trigger;
  // The modules of the world are known by their names while somebody has them.
  absl::StatusOr<ClusterStatus> now;
  if (!options.programs.empty()) {
    now = client.status();
    if (!now.ok()) return now.status();
  }
  for (const std::string& text : options.programs) {
    absl::StatusOr<ProgramRecord> program = parse_program(text, body.modules);
    if (!program.ok()) return program.status();
    body.body.programs.push_back(*std::move(program));
  }
  body.body.linear_velocity = options.first;
  body.body.angular_velocity = options.second;
  const absl::StatusOr<Spawned> spawned = client.spawn(body);
  if (!spawned.ok()) return spawned.status();
  data = {{"id", spawned->id.value}, {"tick", spawned->tick}};
  absl::PrintF("body %d, from tick %d on\n", spawned->id.value, spawned->tick);
  return absl::OkStatus();
}

// The one model of a file, under its own name or another one.
absl::Status spawn_model(const BodyOptions& options, Client& client, nlohmann::json& data) {
  absl::StatusOr<WorldDescription> model = load_model_file(options.model);
  if (!model.ok()) return model.status();
  if (!options.name.empty()) {
    if (absl::Status status = rename_model(options.name, *model); !status.ok()) return status;
  }
  CommandList commands;
  commands.spawn(*model, "", WorldPose{options.at, Eigen::Quaterniond::Identity()});
  const absl::StatusOr<Applied> applied = client.apply(commands);
  if (!applied.ok()) return applied.status();
  const std::string name = model_name(*model);
  data = {{"model", name}, {"bodies", model->bodies.size()}, {"tick", applied->tick}};
  absl::PrintF("model %s of %d bodies, from tick %d on\n", name, model->bodies.size(), applied->tick);
  return absl::OkStatus();
}

void add_spawn(CLI::App& app, Action& action) {
  CLI::App& command =
      add_command(app, "spawn", "Add a body, or the model of a file.",
                  "tessera spawn --name crate --shape box:1,1,1 --mass 10 --at 0,0,5 --sector 0,0,0\n"
                  "  tessera spawn --model worlds/models/walker.sdf --name guard --at 3,3,1");
  const auto options = std::make_shared<BodyOptions>();
  CLI::Option* name =
      command.add_option("--name", options->name, "unique in the world; of a model, in the place of its own");
  CLI::Option* shape =
      add_parsed(command, "--shape", options->shape, parse_shape,
                 "box:X,Y,Z sphere:R capsule:R,LENGTH cylinder:R,LENGTH ellipsoid:X,Y,Z plane:X,Y,Z")
          ->needs(name);
  CLI::Option* model = command
                           .add_option("--model", options->model,
                                       "FILE: the model of an SDF, URDF or MJCF file, instead of a shape")
                           ->check(CLI::ExistingFile)
                           ->excludes(shape);
  command.parse_complete_callback([shape, model] {
    if (shape->empty() && model->empty()) throw CLI::RequiredError("--shape or --model");
  });
  add_position_options(command, *options);
  command.add_option("--mass", options->mass, "kg")->capture_default_str();
  command.add_option("--friction", options->friction, "Coulomb coefficient")->capture_default_str();
  add_parsed(command, "--linear", options->first, parse_vector, "X,Y,Z: velocity, m/s");
  add_parsed(command, "--angular", options->second, parse_vector, "X,Y,Z: angular velocity, rad/s");
  CLI::Option* fixed = command.add_flag("--static", options->fixed, "it never moves");
  command.add_flag("--kinematic", options->kinematic, "it moves only as it is told to")->excludes(fixed);
  command.add_flag("--trigger", options->trigger, "it notices what overlaps it, and touches nothing");
  command.add_option(
      "--program", options->programs,
      "KIND or KIND:NAME=NUMBER,...: a program of the body, with parameters and inputs; KIND "
      "may be the name of a module that the world has, or FILE.wasm, which it then has; repeatable");
  on_cluster(command, action, [options](Client& client, nlohmann::json& data) {
    return options->model.empty() ? spawn_body(*options, client, data) : spawn_model(*options, client, data);
  });
}

void add_remove(CLI::App& app, Action& action) {
  CLI::App& command = add_command(app, "remove", "Remove a body or a model.", "tessera remove crate");
  const auto options = std::make_shared<BodyOptions>();
  add_body_option(command, *options);
  command.add_flag("--model", options->is_model, "it names a model, of which all bodies go");
  on_cluster(command, action, [options](Client& client, nlohmann::json& data) -> absl::Status {
    if (!options->is_model) return print_effect(client.remove(parse_body(options->body)), data);
    CommandList commands;
    commands.remove_all(options->body + "::");
    const absl::StatusOr<Applied> applied = client.apply(commands);
    if (!applied.ok()) return applied.status();
    return print_effect(applied->tick, data);
  });
}

// The commands that take a body and two vectors.
using VectorCall = absl::StatusOr<Tick> (*)(Client&, const BodyName&, const Eigen::Vector3d&,
                                            const Eigen::Vector3d&);

struct VectorCommand {
  const char* name;
  const char* help;
  const char* example;
  const char* first;
  const char* first_help;
  const char* second;
  const char* second_help;
  VectorCall call;
};

constexpr VectorCommand kVectorCommands[] = {
    {"velocity", "Set the velocity of a body.", "tessera velocity crate --linear 1,0,0 --angular 0,0,0.5",
     "--linear", "X,Y,Z: m/s, world axes", "--angular", "X,Y,Z: rad/s",
     [](Client& client, const BodyName& body, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
       return client.set_velocity(body, a, b);
     }},
    {"impulse", "Apply an impulse to a body.", "tessera impulse crate --impulse 0,0,50", "--impulse",
     "X,Y,Z: N s, world axes", "--lever", "X,Y,Z: where it acts, m from the centre of mass, world axes",
     [](Client& client, const BodyName& body, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
       return client.apply_impulse(body, a, b);
     }},
    {"force", "Apply a force to a body for one tick.", "tessera force crate --force 0,0,500 --torque 0,0,1",
     "--force", "X,Y,Z: N, world axes", "--torque", "X,Y,Z: N m",
     [](Client& client, const BodyName& body, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
       return client.apply_force(body, a, b);
     }},
    {"belt", "Start or stop the moving surface of a body (conveyor belt, track).",
     "tessera belt conveyor --velocity 0.5,0,0", "--velocity",
     "X,Y,Z: m/s, in the body frame; 0,0,0 stops it", "--running",
     "X,Y,Z: m/s, the axis that it runs around, as a track does",
     [](Client& client, const BodyName& body, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
       return client.set_surface_motion(body, a, b);
     }},
};

void add_vector_command(CLI::App& app, Action& action, const VectorCommand& spec) {
  CLI::App& command = add_command(app, spec.name, spec.help, spec.example);
  const auto options = std::make_shared<BodyOptions>();
  add_body_option(command, *options);
  add_parsed(command, spec.first, options->first, parse_vector, spec.first_help)->required();
  add_parsed(command, spec.second, options->second, parse_vector, spec.second_help);
  on_cluster(command, action, [options, call = spec.call](Client& client, nlohmann::json& data) {
    return print_effect(call(client, parse_body(options->body), options->first, options->second), data);
  });
}

void add_teleport(CLI::App& app, Action& action) {
  CLI::App& command =
      add_command(app, "teleport", "Move a body to another place at once, keeping its orientation.",
                  "tessera teleport crate --sector 2^40,0,0 --at 0,0,5 --linear 1,0,0");
  const auto options = std::make_shared<BodyOptions>();
  add_body_option(command, *options);
  add_position_options(command, *options);
  struct Velocities {
    std::optional<Eigen::Vector3d> linear;
    std::optional<Eigen::Vector3d> angular;
    bool alone = false;
  };
  const auto velocities = std::make_shared<Velocities>();
  add_parsed(command, "--linear", velocities->linear, parse_vector,
             "X,Y,Z: its velocity then, m/s; as before if not given");
  add_parsed(command, "--angular", velocities->angular, parse_vector, "X,Y,Z: rad/s; likewise");
  command.add_flag("--alone", velocities->alone,
                   "also if joints hold it: they then pull it and what they hold together");
  on_cluster(command, action, [options, velocities](Client& client, nlohmann::json& data) {
    return print_effect(client.teleport(parse_body(options->body), {options->at}, velocities->linear,
                                        velocities->angular, kCallTimeout, velocities->alone),
                        data);
  });
}

void add_target(CLI::App& app, Action& action) {
  CLI::App& command =
      add_command(app, "target", "Move a kinematic body to a place within one tick, keeping its orientation.",
                  "tessera target lift --at 0,0,0.1");
  const auto options = std::make_shared<BodyOptions>();
  add_body_option(command, *options);
  add_position_options(command, *options);
  on_cluster(command, action, [options](Client& client, nlohmann::json& data) {
    return print_effect(client.set_kinematic_target(parse_body(options->body), {options->at}), data);
  });
}

}  // namespace

BodyName parse_body(const std::string& text) {
  std::uint64_t id = 0;
  const bool digits = std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (digits && absl::SimpleAtoi(text, &id)) return BodyId{id};
  return text;
}

absl::Status print_effect(const absl::StatusOr<Tick>& tick, nlohmann::json& data) {
  if (!tick.ok()) return tick.status();
  data["tick"] = *tick;
  absl::PrintF("takes effect at tick %d\n", *tick);
  return absl::OkStatus();
}

void add_body_commands(CLI::App& app, Action& action) {
  add_spawn(app, action);
  add_remove(app, action);
  for (const VectorCommand& spec : kVectorCommands) add_vector_command(app, action, spec);
  add_teleport(app, action);
  add_target(app, action);
}

}  // namespace tessera::cli
