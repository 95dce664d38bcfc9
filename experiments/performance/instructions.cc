// Counts the instructions of ticks of a small scene, for tests/performance_check.py:
//
//   performance_instructions SCENE WORLD
//
// Prints a JSON object: "bodies", "ticks" that are counted, "avx2" (whether contacts are solved in lanes of
// AVX2) and "instructions", null where the kernel does not count them. callgrind can, with
// --toggle-collect=counted_ticks.
#include <absl/strings/str_format.h>
#include <linux/perf_event.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "experiments/performance/scenes.h"
#include "experiments/robots/robot.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/plain_world.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

constexpr Tick kCounted = 30;

// Instructions of this process in user mode.
class Counter {
 public:
  Counter() {
    perf_event_attr event{};
    event.type = PERF_TYPE_HARDWARE;
    event.size = sizeof(event);
    event.config = PERF_COUNT_HW_INSTRUCTIONS;
    event.disabled = 1;
    event.inherit = 1;
    event.exclude_kernel = 1;
    event.exclude_hv = 1;
    file_ = static_cast<int>(syscall(SYS_perf_event_open, &event, 0, -1, -1, 0));
  }
  ~Counter() {
    if (file_ >= 0) close(file_);
  }
  Counter(const Counter&) = delete;
  Counter& operator=(const Counter&) = delete;

  void start() const { ioctl(file_, PERF_EVENT_IOC_ENABLE, 0); }
  std::optional<std::uint64_t> stop() const {
    ioctl(file_, PERF_EVENT_IOC_DISABLE, 0);
    std::uint64_t count = 0;
    if (file_ < 0 || read(file_, &count, sizeof(count)) != sizeof(count) || count == 0) return std::nullopt;
    return count;
  }

 private:
  int file_ = -1;
};

struct Scene {
  std::function<WorldDescription(const WorldSettings&)> make;
  Tick uncounted = 30;  // until most has landed
  std::function<std::vector<Command>(double time)> commands = [](double) { return std::vector<Command>(); };
};

Scene poured(Poured kind) {
  return {[kind](const WorldSettings& settings) { return poured_bodies(settings, kind, 256); }, 80};
}

Scene ants() {
  constexpr int kAnts = 4;
  return {
      [](const WorldSettings& settings) { return robots::robots_on_plane(settings, robots::ant(), kAnts); },
      30, [](double time) { return robots::servo_targets(robots::ant(), 0, kAnts, time); }};
}

const std::map<std::string, Scene>& scenes() {
  static const std::map<std::string, Scene> all = {
      {"pile", {[](const WorldSettings& settings) { return dropped_boxes(settings, 512); }}},
      {"pyramid", {[](const WorldSettings& settings) { return pyramid_world(settings, 20); }}},
      {"mixed", {[](const WorldSettings& settings) { return mixed_bodies(settings, 560); }}},
      {"ants", ants()},
      {"bin_balls", poured(Poured::kBalls)},
      {"bin_capsules", poured(Poured::kCapsules)},
      {"bin_boxes", poured(Poured::kBoxes)},
      {"bin_cylinders", poured(Poured::kCylinders)},
      {"bin_all", poured(Poured::kAll)},
  };
  return all;
}

using Step = std::function<void(std::span<const Command>)>;

// Steps a world in f32 by one tick.
absl::StatusOr<Step> stepped(const WorldDescription& world, bool is_plain) {
  if (is_plain) {
    absl::StatusOr<std::shared_ptr<PlainWorld>> plain = PlainWorld::create(world, Precision::kFloat32);
    if (!plain.ok()) return plain.status();
    return [plain = *std::move(plain)](std::span<const Command> commands) {
      for (const Command& command : commands) {
        if (const auto* set = std::get_if<SetDrives>(&command)) plain->set_drives(set->id, set->drives);
      }
      plain->step();
    };
  }
  absl::StatusOr<std::shared_ptr<Simulation>> simulation = Simulation::create(world);
  if (!simulation.ok()) return simulation.status();
  return [simulation = *std::move(simulation)](std::span<const Command> commands) {
    simulation->step(commands);
  };
}

// Ticks from one on, up to another.
void run(const Step& step, const Scene& scene, const WorldSettings& settings, Tick from, Tick to) {
  for (Tick tick = from; tick < to; ++tick)
    step(scene.commands(static_cast<double>(tick) * settings.time_step));
}

}  // namespace
}  // namespace tessera

// callgrind finds it by this name.
extern "C" [[gnu::noinline]] void counted_ticks(const std::function<void()>& run) { run(); }

int main(int argc, char** argv) {
  const std::string scene = argc == 3 ? argv[1] : "";
  const std::string world = argc == 3 ? argv[2] : "";
  const auto made = tessera::scenes().find(scene);
  if (made == tessera::scenes().end() || (world != "sectors" && world != "one_sector" && world != "plain")) {
    std::cerr << "usage: performance_instructions SCENE sectors|one_sector|plain\nSCENE is one of";
    for (const auto& [name, its] : tessera::scenes()) std::cerr << " " << name;
    std::cerr << "\n";
    return 2;
  }
  tessera::WorldSettings settings;
  settings.sleep_after = 0;
  settings.sector_size = world == "sectors" ? 16 : 512;
  const tessera::WorldDescription description = made->second.make(settings);
  const absl::StatusOr<tessera::Step> step = tessera::stepped(description, world == "plain");
  if (!step.ok()) {
    std::cerr << step.status() << "\n";
    return 1;
  }
  const tessera::Tick from = made->second.uncounted;
  tessera::run(*step, made->second, settings, 0, from);
  const tessera::Counter counter;
  counter.start();
  counted_ticks([&] { tessera::run(*step, made->second, settings, from, from + tessera::kCounted); });
  const std::optional<std::uint64_t> count = counter.stop();
  const auto motion = [](const tessera::BodyDescription& body) { return body.properties.motion; };
  std::cout << absl::StrFormat(R"({"bodies": %d, "ticks": %d, "avx2": %s, "instructions": %s})",
                               std::ranges::count(description.bodies, tessera::Motion::kDynamic, motion),
                               tessera::kCounted, __builtin_cpu_supports("avx2") ? "true" : "false",
                               count ? std::to_string(*count) : "null")
            << "\n";
}
