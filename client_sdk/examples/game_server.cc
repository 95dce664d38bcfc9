// A game server at 60 Hz beside a cluster (`tessera up --servers 2`): 500 characters walk on ground that rays
// find under their feet, doors move, bombs go off, a zone counts who is in it, and balls are thrown in and
// taken away. Each frame is one message there and back. A frame acts on the answers to the message of the
// frame before: while they come, the game does what else a frame needs, and waits for nobody.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tessera/client.h"

namespace {

using Clock = std::chrono::steady_clock;
using Eigen::Vector3d;

constexpr int kCharacters = 500;
constexpr int kDoors = 4;
constexpr int kInRow = 25;
constexpr auto kFrame = std::chrono::microseconds(16'667);

template <typename T>
T value_or_end(absl::StatusOr<T> result, const char* what) {
  if (result.ok()) return *std::move(result);
  std::fprintf(stderr, "%s: %s\n", what, std::string(result.status().message()).c_str());
  std::exit(1);
}

tessera::BodyDescription part(const std::string& name, tessera::ShapeId shape, tessera::Motion motion,
                              const Vector3d& place) {
  tessera::BodyDescription body;
  body.name = name;
  body.properties.shape = shape;
  body.properties.motion = motion;
  body.properties.mass = 70;
  body.properties.inertia = {10, 10, 3};
  body.pose.position.local = place;
  return body;
}

Vector3d place_of(int n) {
  const int row = n / kInRow;
  return {2.0 * (n % kInRow) - 24, 2.0 * row - 19, 0.92};
}

// Sectors of 16 m, so that the crowd is in many of them, on both servers.
tessera::WorldDescription town() {
  tessera::WorldDescription world;
  world.name = "town";
  world.settings.sector_size = 16;
  world.shapes = {tessera::box(200, 200, 2), tessera::capsule(0.3, 1.2), tessera::box(3, 0.2, 2.5)};
  world.bodies.push_back(part("ground", 0, tessera::Motion::kStatic, {0, 0, -1}));
  for (int n = 0; n < kCharacters; ++n) {
    world.bodies.push_back(part("character" + std::to_string(n), 1, tessera::Motion::kDynamic, place_of(n)));
  }
  for (int n = 0; n < kDoors; ++n) {
    world.bodies.push_back(
        part("door" + std::to_string(n), 2, tessera::Motion::kKinematic, {-20.0 + 12 * n, 24, 1.3}));
  }
  return world;
}

// What the characters and things do in a frame.
tessera::CommandList act(std::int64_t frame, const std::vector<tessera::BodySample>& characters) {
  tessera::CommandList commands;
  for (const tessera::BodySample& one : characters) {
    const double heading = static_cast<double>(one.id.value) + 0.01 * static_cast<double>(frame);
    commands.set_velocity(one.id, {std::cos(heading), std::sin(heading), one.linear_velocity.z()});
  }
  for (int n = 0; n < kDoors; ++n) {
    const double open = 1.5 * std::sin(0.02 * static_cast<double>(frame) + n);
    commands.set_kinematic_target("door" + std::to_string(n), {{{}, {-20.0 + 12 * n + open, 24, 1.3}}});
  }
  if (frame % 60 == 0) commands.apply_radial_impulse({{}, {0, 0, 0.5}}, 8, 200);
  // A hundred a second come, and go a second later.
  for (std::int64_t n = 5 * frame / 3; n < 5 * (frame + 1) / 3; ++n) {
    commands.spawn(tessera::solid("ball" + std::to_string(n), tessera::sphere(0.2), 1,
                                  {{}, {-20.0 + static_cast<double>(n % 40), -24, 2}}));
    if (n >= 100) commands.remove("ball" + std::to_string(n - 100));
  }
  return commands;
}

// The message of a frame: what all do, and what the next frame wants to know.
struct Message {
  tessera::Batch batch;
  tessera::QueryPlace<std::vector<std::optional<tessera::FirstHit>>> feet;
  tessera::QueryPlace<std::vector<tessera::BodySample>> states;
  tessera::QueryPlace<std::vector<tessera::Neighbour>> zone;
};

Message message_of(std::int64_t frame, const std::vector<tessera::BodySample>& characters) {
  Message message;
  message.batch.commands = act(frame, characters);
  tessera::RaysQuery down;
  for (const tessera::BodySample& one : characters) {
    down.rays.push_back(
        {.origin = one.pose.position, .direction = {0, 0, -1}, .length = 1.2, .except = one.id});
  }
  tessera::QueryList& queries = message.batch.queries;
  message.feet = queries.rays(down);
  message.states = queries.states({}, "character");
  message.zone = queries.near({.pose = {}, .probe = tessera::Box{{10, 10, 4}}, .except = {"ground"}});
  return message;
}

struct Answered {
  absl::StatusOr<tessera::Answers> answers;
  Clock::time_point at;
};

// They come on a thread of the client.
std::future<Answered> send(tessera::Client& client, const tessera::Batch& batch) {
  const auto answered = std::make_shared<std::promise<Answered>>();
  std::future<Answered> future = answered->get_future();
  client.send(batch, [answered](absl::StatusOr<tessera::Answers> answers) {
    answered->set_value({std::move(answers), Clock::now()});
  });
  return future;
}

double milliseconds(Clock::duration time) { return std::chrono::duration<double, std::milli>(time).count(); }

void print(const char* what, std::vector<double> times) {
  std::sort(times.begin(), times.end());
  std::printf("%s: %.2f ms (median), %.2f ms (99 in 100)\n", what, times[times.size() / 2],
              times[times.size() * 99 / 100]);
}

}  // namespace

int main(int argc, char** argv) {
  const auto client =
      value_or_end(tessera::Client::connect(argc > 1 ? argv[1] : "127.0.0.1:7300"), "connect");
  const int seconds = argc > 2 ? std::atoi(argv[2]) : 10;
  value_or_end(client->load(town(), /*replace=*/true), "load");
  value_or_end(client->resume(1), "resume");
  std::vector<double> waits;      // ms, of a frame, for what it acts on
  std::vector<double> latencies;  // ms, from the beginning of a frame to the answers to its message
  std::size_t grounded = 0;
  std::size_t in_zone = 0;
  Message message = message_of(0, {});
  Clock::time_point begun = Clock::now();
  std::future<Answered> answered = send(*client, message.batch);
  for (std::int64_t frame = 1; frame <= 60 * seconds; ++frame) {
    // Here a game has its rules, its players, its pathfinding.
    std::this_thread::sleep_until(begun + kFrame);
    const Clock::time_point wanted = Clock::now();
    Answered last = answered.get();
    waits.push_back(milliseconds(Clock::now() - wanted));
    latencies.push_back(milliseconds(last.at - begun));
    begun += kFrame;
    const tessera::Answers answers = value_or_end(std::move(last.answers), "frame");
    const auto hits = answers[message.feet];
    grounded = static_cast<std::size_t>(
        std::count_if(hits.begin(), hits.end(), [](const auto& hit) { return hit.has_value(); }));
    in_zone = answers[message.zone].size();
    message = message_of(frame, answers[message.states]);
    answered = send(*client, message.batch);
  }
  answered.wait();
  const tessera::ClusterStatus status = value_or_end(client->status(), "status");
  std::printf("%zu frames, each one message\n", waits.size());
  print("a frame waits for answers", std::move(waits));
  print("answers take", std::move(latencies));
  std::printf("tick %llu, real-time factor %.2f, %llu bodies; %zu of %d on the ground, %zu in the zone\n",
              static_cast<unsigned long long>(status.tick), status.real_time_factor,
              static_cast<unsigned long long>(status.bodies), grounded, kCharacters, in_zone);
  return 0;
}
