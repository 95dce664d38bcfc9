#include "experiments/clients/clients.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "cli/measure/stopwatch.h"
#include "experiments/local_servers.h"
#include "experiments/robots/robot.h"
#include "experiments/scenes.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera {
namespace {

constexpr int kServersOfClients = 2;
constexpr int kCharacters = 500;
constexpr int kManyClients = 16;
constexpr int kManyRobots = 100;        // of 8 hinges
constexpr double kCharactersApart = 2;  // m, from one character to the next
constexpr int kCharactersInRow = 25;

struct Figures {
  std::uint64_t calls = 0;
  double seconds = 0;
  std::vector<double> waits_ms;

  double quantile(double part) {
    if (waits_ms.empty()) return 0;
    const auto place = static_cast<std::size_t>(part * static_cast<double>(waits_ms.size() - 1));
    std::nth_element(waits_ms.begin(), waits_ms.begin() + static_cast<std::ptrdiff_t>(place), waits_ms.end());
    return waits_ms[place];
  }
};

// Characters in a square on a floor over sectors of 16 m: capsules that do not turn.
WorldDescription characters(WorldSettings settings) {
  settings.sector_size = 16;
  settings.sleep_after = 0;
  WorldBuilder builder(settings);
  builder.add_floor(100, 0);
  const ShapeId capsule = builder.shape(Capsule{0.3, 1.2});
  for (int n = 0; n < kCharacters; ++n) {
    const int row = n / kCharactersInRow;
    const Eigen::Vector3d place(kCharactersApart * (n % kCharactersInRow) - 25, kCharactersApart * row - 20,
                                0.91);
    builder.add(absl::StrCat("character", n), capsule, 70, place);
  }
  return builder.world();
}

// Calls `once` until the time is over; each call is one that its client waits for.
absl::Status repeat(absl::Duration time, Figures& figures, const std::function<absl::Status()>& once) {
  const Stopwatch all;
  while (all.microseconds() < absl::ToDoubleMicroseconds(time)) {
    const Stopwatch watch;
    if (absl::Status status = once(); !status.ok()) return status;
    figures.waits_ms.push_back(watch.microseconds() / 1e3);
    ++figures.calls;
  }
  figures.seconds = all.microseconds() / 1e6;
  return absl::OkStatus();
}

class ClientFigures {
 public:
  ClientFigures(const ExperimentOptions& options, const Progress& progress)
      : options_(options), time_(absl::Seconds(options.quick ? 0.3 : 3)), count_(progress, 0, report_) {}

  absl::StatusOr<Report> measure() {
    auto started = experiments::LocalServers::start(kServersOfClients, options_.precision);
    if (!started.ok()) return started.status();
    servers_ = *std::move(started);
    WorldSettings settings;
    settings.precision = options_.precision;
    const std::vector<std::pair<std::string, std::function<absl::Status()>>> scenes = {
        {"commands", [&] { return commands(characters(settings)); }},
        {"rays", [&] { return rays(characters(settings)); }},
        {"game server", [&] { return game_server(characters(settings)); }},
        {"lock step", [&] { return lock_step(settings, 1); }},
        {"lock step with many", [&] { return lock_step(settings, kManyRobots); }}};
    count_.expect(scenes.size());
    for (const auto& [name, measure] : scenes) {
      if (name.find(options_.only) != std::string::npos) {
        if (absl::Status status = measure(); !status.ok()) return status;
      }
      if (absl::Status status = count_.advance(); !status.ok()) return status;
    }
    return std::move(report_);
  }

 private:
  Client& client() { return servers_->client(); }

  // The world, which runs at 60 Hz if `runs`.
  absl::Status load(const WorldDescription& world, bool runs) {
    if (auto loaded = client().load(world, /*replace=*/true); !loaded.ok()) return loaded.status();
    if (!runs) return absl::OkStatus();
    return client().resume(1).status();
  }

  void add(const std::string& scene, int clients, std::uint64_t list, Figures figures,
           const std::string& hash = "") {
    const double done = static_cast<double>(figures.calls * list);
    report_.table("rows").push_back({{"engine", name_of(options_.precision)},
                                     {"scene", scene},
                                     {"clients", clients},
                                     {"list", list},
                                     {"calls", figures.calls},
                                     {"per_second", done / figures.seconds},
                                     {"p50_ms", figures.quantile(0.5)},
                                     {"p99_ms", figures.quantile(0.99)},
                                     {"hash", hash}});
  }

  static BodyId character(std::uint64_t n) { return BodyId{2 + n % kCharacters}; }

  static Batch velocities(std::uint64_t first, int count) {
    Batch batch;
    for (int n = 0; n < count; ++n)
      batch.commands.set_velocity(character(first + static_cast<std::uint64_t>(n)), {0.1, 0, 0});
    return batch;
  }

  absl::Status commands(const WorldDescription& world) {
    if (absl::Status loaded = load(world, /*runs=*/true); !loaded.ok()) return loaded;
    Figures effect;
    absl::Status status = repeat(time_, effect, [&, n = std::uint64_t{0}]() mutable -> absl::Status {
      const absl::StatusOr<Answers> given = client().run(velocities(n, 1));
      if (!given.ok()) return given.status();
      QueryList seen;
      seen.states({character(n++)});
      return client().ask(seen).status();
    });
    if (!status.ok()) return status;
    add("command to effect", 1, 1, std::move(effect));
    Figures one_by_one;
    status = repeat(time_, one_by_one, [&, n = std::uint64_t{0}]() mutable {
      return client().run(velocities(n++, 1)).status();
    });
    if (!status.ok()) return status;
    add("commands one by one", 1, 1, std::move(one_by_one));
    for (const int clients : {1, kManyClients}) {
      for (const int list : {1, 100}) {
        absl::StatusOr<Figures> streamed = stream(clients, list);
        if (!streamed.ok()) return streamed.status();
        add("commands on a stream", clients, static_cast<std::uint64_t>(list), *std::move(streamed));
      }
    }
    return absl::OkStatus();
  }

  // Each client sends for the time, and waits for the last answer.
  absl::StatusOr<Figures> stream(int clients, int list) {
    std::vector<std::unique_ptr<Client>> all;
    for (int n = 0; n < clients; ++n) {
      absl::StatusOr<std::unique_ptr<Client>> another = Client::connect(servers_->cluster().address());
      if (!another.ok()) return another.status();
      all.push_back(*std::move(another));
    }
    std::vector<std::uint64_t> sent(all.size());
    std::vector<absl::Status> failed(all.size());
    const Stopwatch watch;
    std::vector<std::thread> threads;
    for (std::size_t n = 0; n < all.size(); ++n) {
      threads.emplace_back([&, n] {
        while (watch.microseconds() < absl::ToDoubleMicroseconds(time_)) {
          all[n]->send(velocities(sent[n]++, list), [](const absl::StatusOr<Answers>&) {});
        }
        failed[n] = all[n]->run(velocities(0, 1)).status();  // acknowledged in order
      });
    }
    for (std::thread& thread : threads) thread.join();
    Figures figures;
    figures.seconds = watch.microseconds() / 1e6;
    for (std::size_t n = 0; n < all.size(); ++n) {
      if (!failed[n].ok()) return failed[n];
      figures.calls += sent[n];
    }
    return figures;
  }

  static RaysQuery::Ray down_at(std::uint64_t n) {
    RaysQuery::Ray ray;
    ray.origin.local = {kCharactersApart * static_cast<double>(n % kCharactersInRow) - 25.0,
                        kCharactersApart * static_cast<double>(n / kCharactersInRow % 20) - 20.0, 5};
    ray.direction = {0, 0, -1};
    ray.length = 10;
    return ray;
  }

  static void add_one_by_one(const RaysQuery& rays, QueryList& queries) {
    for (const RaysQuery::Ray& ray : rays.rays)
      queries.ray({.origin = ray.origin, .direction = ray.direction, .length = ray.length});
  }

  absl::Status rays(const WorldDescription& world) {
    if (absl::Status status = load(world, /*runs=*/true); !status.ok()) return status;
    for (const bool in_columns : {false, true}) {
      for (const int list : {1, 100, 1000, 10'000}) {
        Figures figures;
        absl::Status status = repeat(time_, figures, [&, n = std::uint64_t{0}]() mutable {
          RaysQuery rays;
          for (int k = 0; k < list; ++k) rays.rays.push_back(down_at(n++));
          Batch batch;
          in_columns ? static_cast<void>(batch.queries.rays(rays)) : add_one_by_one(rays, batch.queries);
          return client().run(batch).status();
        });
        if (!status.ok()) return status;
        add(in_columns ? "rays in columns" : "rays", 1, static_cast<std::uint64_t>(list), std::move(figures));
      }
    }
    return absl::OkStatus();
  }

  // In each tick that the world begins, as a game server at 60 Hz does.
  absl::Status game_server(const WorldDescription& world) {
    if (absl::Status status = load(world, /*runs=*/true); !status.ok()) return status;
    Figures figures;
    absl::Status status = repeat(time_, figures, [&] {
      Batch batch = velocities(0, kCharacters);
      RaysQuery feet;
      for (std::uint64_t k = 0; k < kCharacters; ++k) feet.rays.push_back(down_at(k));
      batch.queries.rays(feet);
      batch.queries.states({});
      return client().run(batch).status();
    });
    if (!status.ok()) return status;
    add("game server", 1, 2 * kCharacters, std::move(figures));
    return absl::OkStatus();
  }

  absl::Status lock_step(const WorldSettings& settings, int count) {
    const robots::Robot ant = robots::ant();
    if (absl::Status status = load(robots::robots_on_plane(settings, ant, count), /*runs=*/false);
        !status.ok())
      return status;
    Tick tick = 0;
    std::vector<JointId> ids;
    std::vector<double> targets, stiffness, damping;
    Figures figures;
    absl::Status status = repeat(time_, figures, [&]() -> absl::Status {
      Batch batch;
      const double time = static_cast<double>(tick) * settings.time_step;
      ids.clear();
      for (std::vector<double>* column : {&targets, &stiffness, &damping}) column->clear();
      for (const Command& command : robots::servo_targets(ant, 0, count, time)) {
        const auto& drives = std::get<SetDrives>(command);
        ids.push_back(drives.id);
        targets.push_back(drives.drives[0].target);
        stiffness.push_back(drives.drives[0].stiffness);
        damping.push_back(drives.drives[0].damping);
      }
      const DriveColumns columns{
          .mode = DriveMode::kServo, .targets = targets, .stiffness = stiffness, .damping = damping};
      batch.commands.set_drives(ids, columns);
      batch.ticks = 1;
      const auto joints = batch.queries.joint_states();
      const absl::StatusOr<Answers> answers = client().run(batch);
      if (!answers.ok()) return answers.status();
      if ((*answers)[joints].size() != ids.size())
        return absl::InternalError("a joint is missing in lock step");
      tick = answers->tick();
      return absl::OkStatus();
    });
    if (!status.ok()) return status;
    const absl::StatusOr<HashAt> hash = client().hash();
    if (!hash.ok()) return hash.status();
    add(absl::StrCat("lock step, ", robots::hinges_of(ant) * static_cast<std::size_t>(count), " joints"), 1,
        1, std::move(figures), absl::StrCat(hash->tick, ":", hash->hash));
    return absl::OkStatus();
  }

  const ExperimentOptions options_;
  const absl::Duration time_;
  ProgressCount count_;
  std::unique_ptr<experiments::LocalServers> servers_;
  Report report_;
};

}  // namespace

absl::StatusOr<Report> measure_clients(const ExperimentOptions& options, const Progress& progress) {
  return ClientFigures(options, progress).measure();
}

}  // namespace tessera
