// Triggers over time: when what falls, flies and is moved enters and leaves, over borders of sectors and
// servers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>
#include <vector>

#include "lpss/engine/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"
#include "lpss/tick/events.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr double kG = 10;          // m/s^2
constexpr double kTicksPerS = 60;  // 1/s

struct Noticed {
  Tick tick = 0;
  ContactPhase phase = ContactPhase::kBegin;
  BodyId trigger;
  BodyId visitor;

  friend auto operator<=>(const Noticed&, const Noticed&) = default;
};

std::ostream& operator<<(std::ostream& out, const Noticed& event) {
  return out << event.tick << (event.phase == ContactPhase::kBegin ? " begins " : " ends ")
             << event.trigger.value << " " << event.visitor.value;
}

Noticed enters(Tick tick, std::uint64_t trigger, std::uint64_t visitor) {
  return {tick, ContactPhase::kBegin, BodyId{trigger}, BodyId{visitor}};
}
Noticed leaves(Tick tick, std::uint64_t trigger, std::uint64_t visitor) {
  return {tick, ContactPhase::kEnd, BodyId{trigger}, BodyId{visitor}};
}

WorldSettings settings_of(double sector_size, double gravity = kG) {
  WorldSettings settings = sectors_of(sector_size);
  settings.precision = engine_tests::test_precision;
  settings.gravity = UniformGravity{{0, 0, -gravity}};
  return settings;
}

BodyDescription& trigger(BodyDescription& body) {
  body.properties.trigger = true;
  return body;
}

class WatchedWorld {
 public:
  WatchedWorld(const WorldDescription& world, std::uint32_t partitions)
      : cluster_(cluster_of(world, partitions)) {
    for (Rank rank = 0; rank < partitions; ++rank) report_contacts(cluster_->partition(rank), true);
  }

  void step(std::span<const Command> commands = {}) {
    cluster_->step(commands);
    std::vector<Noticed> events;
    for (Rank rank = 0; rank < cluster_->size(); ++rank) {
      check_invariants(cluster_->partition(rank));
      for (const ContactEvent& event : cluster_->machine(rank).contact_events()) {
        if (event.trigger && event.phase != ContactPhase::kPersist)
          events.push_back({event.tick, event.phase, event.a, event.b});
        touches_ += event.trigger ? 0 : 1;
      }
    }
    std::sort(events.begin(), events.end());
    events_.insert(events_.end(), events.begin(), events.end());
  }
  void run(int ticks) {
    for (int tick = 0; tick < ticks; ++tick) step();
  }

  const std::vector<Noticed>& events() const { return events_; }
  std::vector<Noticed> take_events() { return std::exchange(events_, {}); }
  int touches() const { return touches_; }  // contacts, in all ticks
  PartitionCluster& cluster() { return *cluster_; }
  BodyState state(std::uint64_t id) const { return cluster_->body(BodyId{id})->state; }

 private:
  std::unique_ptr<PartitionCluster> cluster_;
  std::vector<Noticed> events_;
  int touches_ = 0;
};

// What is in a trigger where a tick begins is told in that tick: that at `time` (s) or after it.
Tick told_after(double time) { return static_cast<Tick>(std::ceil(time * kTicksPerS)) + 1; }

double fall(double height) { return std::sqrt(2 * height / kG); }  // s

TEST(Triggers, WhatFallsEntersAndLeavesWhenItDoes) {
  for (const double size : {64.0, 4.0, 2.5}) {
    for (const double shift : {0.0, 1.25, 0.6}) {
      for (const std::uint32_t partitions : {1u, 2u, 4u}) {
        WorldBuilder builder(settings_of(size));
        // Of a small sector, as much as it needs.
        trigger(builder.add("zone", builder.shape(Box{{40, 40, 1}}), 1, {0, 0, shift}, Motion::kStatic));
        builder.add("ball", builder.shape(Sphere{0.25}), 1, {shift / 2, 0.1, shift + 3});
        WatchedWorld watched(builder.world(), partitions);
        watched.run(80);
        EXPECT_THAT(watched.events(),
                    ElementsAre(enters(told_after(fall(2.25)), 1, 2), leaves(told_after(fall(3.75)), 1, 2)))
            << size << " m, " << shift << " m, " << partitions;
        EXPECT_EQ(watched.touches(), 0);
        EXPECT_NEAR(watched.state(2).linear_velocity[2], -kG * 80 / kTicksPerS, 1e-4);
      }
    }
  }
}

TEST(Triggers, AShotThroughASheetIsNoticedOnce) {
  for (const double size : {64.0, 5.0}) {
    for (const std::uint32_t partitions : {1u, 3u}) {
      WorldBuilder builder(settings_of(size, 0));
      const ShapeId sheet = builder.shape(Box{{1e-3, 6, 6}});
      for (const double x : {8.0, 21.0}) {
        trigger(builder.add(x < 15 ? "first" : "second", sheet, 1, {x, 0, 0}, Motion::kStatic));
      }
      builder.add("bullet", builder.shape(Sphere{0.05}), 0.1, {0, 0.3, 0.4}).linear_velocity = {200, 0, 0};
      WatchedWorld watched(builder.world(), partitions);
      watched.run(12);
      // On its way of 3.33 m in a tick; at the next one, it is beyond.
      EXPECT_THAT(watched.events(),
                  ElementsAre(enters(3, 1, 3), leaves(4, 1, 3), enters(7, 2, 3), leaves(8, 2, 3)))
          << size << " m, " << partitions;
      EXPECT_EQ(watched.state(3).linear_velocity[0], 200);
    }
  }
}

TEST(Triggers, ADoorOpensAndShutsAZone) {
  for (const double size : {64.0, 3.0}) {
    WorldBuilder builder(settings_of(size));
    trigger(builder.add("zone", builder.shape(Box{{1, 1, 1}}), 1, {0, 0, 0}, Motion::kStatic));
    builder.add("door", builder.shape(Box{{0.1, 1, 1}}), 1, {2, 0, 0}, Motion::kKinematic);
    WatchedWorld watched(builder.world(), 2);
    watched.run(10);
    EXPECT_THAT(watched.events(), IsEmpty());
    const auto go_to = [&](double x) {
      KinematicTarget target{BodyId{2}, {0, 0, 0}, {}, false};
      const WorldPosition place = *canonical({0, 0, 0}, {x, 0, 0}, size);
      target.home = place.sector;
      target.state.position = {place.local.x(), place.local.y(), place.local.z()};
      const Command command = target;
      watched.step({&command, 1});
    };
    for (int n = 0; n < 20; ++n) go_to(2 - 0.1 * (n + 1));  // to 0: it is in from 0.5 on
    watched.run(10);
    ASSERT_EQ(watched.events().size(), 1u);
    EXPECT_EQ(watched.take_events().front().phase, ContactPhase::kBegin);
    watched.run(100);  // it rests there
    for (int n = 0; n < 20; ++n) go_to(0.1 * (n + 1));
    watched.run(10);
    ASSERT_EQ(watched.events().size(), 1u);
    EXPECT_EQ(watched.take_events().front().phase, ContactPhase::kEnd);
  }
}

// What a carrier that moves notices does not depend on borders: dynamic, kinematic and static bodies beside
// its way.
TEST(Triggers, ACarrierNoticesTheSameAcrossBorders) {
  const auto events_of = [](Motion motion, double size, std::uint32_t partitions) {
    WorldBuilder builder(settings_of(size, 0));
    PartMaterial notices;
    notices.trigger = true;
    builder.world().shapes.push_back(
        Shape{{ShapePart{Sphere{0.1}, {}}, ShapePart{Sphere{1.2}, {}, notices}}});
    BodyDescription& carrier = builder.add("carrier", 0, 1, {-4.3, 0, 0}, motion);
    carrier.linear_velocity = {6, 0, 0};
    const ShapeId ball = builder.shape(Sphere{0.25});
    for (int n = 0; n < 4; ++n) {
      const double x = -3.1 + 2.3 * n;
      builder.add("dynamic" + std::to_string(n), ball, 1, {x, 0.8, 0.1 * n}).linear_velocity = {0.3, 0, 0};
      builder.add("static" + std::to_string(n), ball, 1, {x, -0.7, 0.1 * n}, Motion::kStatic);
      builder.add("kinematic" + std::to_string(n), ball, 1, {x, 0.1, 0.9}, Motion::kKinematic)
          .linear_velocity = {-0.4, 0, 0};
    }
    WatchedWorld watched(builder.world(), partitions);
    watched.run(120);
    return watched.take_events();
  };
  for (const Motion motion : {Motion::kDynamic, Motion::kKinematic}) {
    const std::vector<Noticed> alone = events_of(motion, 64, 1);
    EXPECT_EQ(alone.size(), 24u);
    for (const double size : {2.5, 4.0}) {
      EXPECT_EQ(events_of(motion, size, 1), alone) << name_of(motion) << " " << size;
      EXPECT_EQ(events_of(motion, size, 4), alone) << name_of(motion) << " " << size;
    }
  }
}

// Past a carrier in the middle of one sector, out of another one: below and above the speed from which a body
// is looked after by the home of the slower one.
TEST(Triggers, AShotPastACarrierIsNoticedOnce) {
  for (const double speed : {20.0, 200.0, -20.0, -200.0}) {
    for (const double size : {64.0, 5.0}) {
      for (const std::uint32_t partitions : {1u, 3u}) {
        WorldBuilder builder(settings_of(size, 0));
        PartMaterial notices;
        notices.trigger = true;
        builder.world().shapes.push_back(
            Shape{{ShapePart{Sphere{0.1}, {}}, ShapePart{Sphere{0.4}, {}, notices}}});
        builder.add("carrier", 0, 1, {0.3, 0, 0});
        builder.add("bullet", builder.shape(Sphere{0.05}), 0.1, {speed > 0 ? -8.1 : 8.9, 0.3, 0})
            .linear_velocity = {speed, 0, 0};
        WatchedWorld watched(builder.world(), partitions);
        watched.run(40);
        const double half_chord = std::sqrt(0.45 * 0.45 - 0.3 * 0.3);
        const double apart = speed > 0 ? 8.4 : 8.6;
        const double in = (apart - half_chord) / std::abs(speed);
        const double out = (apart + half_chord) / std::abs(speed);
        const bool is_fast = std::abs(speed) > 50;
        EXPECT_THAT(watched.events(), ElementsAre(enters(is_fast ? told_after(in) - 1 : told_after(in), 1, 2),
                                                  leaves(told_after(out), 1, 2)))
            << speed << " m/s, " << size << " m, " << partitions;
      }
    }
  }
}

// A walker with a sphere that notices passes over boxes that sleep.
TEST(Triggers, WhatSleepsSleepsOnAndNothingIsPushed) {
  for (const double size : {64.0, 4.0}) {
    WorldBuilder builder(settings_of(size));
    builder.world().settings.sleep_after = 0.2;
    builder.add_floor(50, 0);
    const ShapeId box = builder.shape(Box{{0.5, 0.5, 0.5}});
    for (int n = 0; n < 5; ++n) builder.add("box" + std::to_string(n), box, 1, {2.0 * n, 0.1 * n, 0.25});
    PartMaterial notices;
    notices.trigger = true;
    const ShapeId id = builder.world().shapes.size();
    builder.world().shapes.push_back(
        Shape{{ShapePart{Sphere{0.2}, {}}, ShapePart{Sphere{1.5}, {}, notices}}});
    BodyDescription& walker = builder.add("walker", id, 1, {-3, 0, 1.2});
    walker.properties.gravity = false;
    walker.properties.motion = Motion::kDynamic;
    WatchedWorld watched(builder.world(), 2);
    watched.run(120);
    watched.take_events();
    const std::uint64_t walks = 7;
    const Command go = SetVelocity{BodyId{walks}, {3, 0, 0}, {}};
    watched.step({&go, 1});
    int noticed = 0;
    for (int tick = 0; tick < 240; ++tick) {
      watched.step();
      for (std::uint64_t n = 2; n < 7; ++n) ASSERT_EQ(watched.state(n).activity, Activity::kAsleep);
    }
    for (const Noticed& event : watched.events()) {
      EXPECT_EQ(event.trigger.value, walks);
      noticed += event.phase == ContactPhase::kBegin && event.visitor.value != 1 ? 1 : 0;
    }
    EXPECT_EQ(noticed, 5);
    EXPECT_EQ(watched.state(walks).linear_velocity, (std::array<double, 3>{3, 0, 0}));
  }
}

TEST(Triggers, CommandsEndWhatTheyTakeAway) {
  WorldBuilder builder(settings_of(8));
  builder.world().settings.sleep_after = 0.1;
  builder.add_floor(20, 0);
  trigger(builder.add("zone", builder.shape(Box{{20, 6, 2}}), 1, {0, 0, 1}, Motion::kStatic));
  const ShapeId box = builder.shape(Box{{0.5, 0.5, 0.5}});
  for (int n = 0; n < 4; ++n) builder.add("box" + std::to_string(n), box, 1, {-6 + 4.0 * n, 0, 0.25});
  for (const std::uint64_t pack_after : {std::uint64_t{0}, std::uint64_t{1000}}) {
    for (const std::uint32_t partitions : {1u, 3u}) {
      WatchedWorld watched(builder.world(), partitions);
      for (Rank rank = 0; rank < partitions; ++rank)
        watched.cluster().partition(rank).pack_after = pack_after;
      watched.run(100);
      EXPECT_THAT(watched.take_events(),
                  ElementsAre(enters(1, 2, 3), enters(1, 2, 4), enters(1, 2, 5), enters(1, 2, 6)));
      const Command removal = RemoveBody{BodyId{3}};
      watched.step({&removal, 1});
      EXPECT_THAT(watched.take_events(), ElementsAre(leaves(101, 2, 3)));
      BodyState away;
      away.position = {1, 1, 3.9};
      const Command teleport = Teleport{BodyId{4}, {0, 2, 0}, away};
      watched.step({&teleport, 1});
      EXPECT_THAT(watched.take_events(), ElementsAre(leaves(102, 2, 4)));
      watched.run(60);
      EXPECT_THAT(watched.take_events(), IsEmpty());
      const Command zone = RemoveBody{BodyId{2}};
      watched.step({&zone, 1});
      EXPECT_THAT(watched.take_events(), ElementsAre(leaves(163, 2, 5), leaves(163, 2, 6)));
      // A new zone notices what sleeps in it.
      watched.run(60);
      BodyRecord again = records_of(builder.world())->at(1);
      again.id = BodyId{30};
      const Command spawn = SpawnBody{again};
      watched.step({&spawn, 1});
      EXPECT_THAT(watched.take_events(), ElementsAre(enters(224, 30, 5), enters(224, 30, 6)));
      EXPECT_EQ(watched.state(5).activity, Activity::kAsleep);
      BodyRecord blind = again;
      blind.properties.mask = 0;
      const Command change = SetProperties{BodyId{30}, blind.properties};
      watched.step({&change, 1});
      EXPECT_THAT(watched.take_events(), ElementsAre(leaves(225, 30, 5), leaves(225, 30, 6)));
    }
  }
}

// A body with a trigger moves as one without, to the last bit.
TEST(Triggers, ChangeNoBitOfWhatTouches) {
  const WorldDescription plain = pile_world(settings_of(4, 9.81), 40);
  WorldDescription noticing = plain;
  PartMaterial notices;
  notices.trigger = true;
  for (std::size_t n = 1; n < noticing.shapes.size(); ++n) {
    noticing.shapes[n].parts.push_back(
        ShapePart{Sphere{0.9}, {{0.1, 0, 0.2}, Eigen::Quaterniond::Identity()}, notices});
  }
  EXPECT_EQ(run(plain, 1, 1, 200), run(noticing, 1, 1, 200));
  const WorldDescription chain = chain_world(settings_of(4, 9.81), 12, {0, 0, 5});
  WorldDescription sensing = chain;
  for (Shape& shape : sensing.shapes) shape.parts.push_back(ShapePart{Sphere{1}, {}, notices});
  EXPECT_EQ(run(chain, 1, 1, 200), run(sensing, 1, 1, 200));
}

}  // namespace
}  // namespace tessera
