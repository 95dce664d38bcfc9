// Which pairs may touch: whatever bodies did before, those whose boxes overlap are found.
#include "lpss/native/broad_phase.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace tessera::native {
namespace {

using Pairs = std::set<std::pair<std::uint64_t, std::uint64_t>>;

class Bodies {
 public:
  Bodies() : solid_(std::make_shared<const Solid>(Shape{{ShapePart{tessera::Box{}, {}}}}, Pose{}, false)) {}

  void add(std::uint64_t id, const Vector& position) {
    BodyRecord record;
    record.id = {id};
    record.state.position = array(position);
    bodies.emplace_back(record, Role::kHome, solid_, EngineSettings{});
    bodies.back().bounds = bodies.back().bounds_at(bodies.back().pose);
    phase.add(bodies.back(), static_cast<BodySlot>(bodies.size() - 1));
  }

  void move(std::size_t n, const Vector& position) {
    bodies[n].pose.position = position;
    bodies[n].bounds = bodies[n].bounds_at(bodies[n].pose);
    phase.update(bodies[n], static_cast<BodySlot>(n), Scalar(1) / 60);
  }

  void find() {
    phase.find_pairs(bodies, candidates, [](const Body&, const Body&) { return true; });
    // As a world does.
    std::erase_if(candidates, [&](const Candidate& c) {
      return !bodies[static_cast<std::size_t>(c.slot_a)].enlarged.overlaps(
          bodies[static_cast<std::size_t>(c.slot_b)].enlarged);
    });
  }

  Pairs near() const {
    Pairs pairs;
    for (const Candidate& c : candidates) {
      const Body& a = bodies[static_cast<std::size_t>(c.slot_a)];
      const Body& b = bodies[static_cast<std::size_t>(c.slot_b)];
      if (a.bounds.overlaps(b.bounds)) pairs.insert({c.a.value, c.b.value});
    }
    return pairs;
  }

  Pairs overlapping() const {
    Pairs pairs;
    for (const Body& a : bodies) {
      for (const Body& b : bodies) {
        if (a.id < b.id && a.bounds.overlaps(b.bounds)) pairs.insert({a.id.value, b.id.value});
      }
    }
    return pairs;
  }

  std::vector<Body> bodies;
  BroadPhase phase;
  std::vector<Candidate> candidates;

 private:
  std::shared_ptr<const Solid> solid_;
};

TEST(BroadPhaseTest, FindsAllPairsWhoseBoxesOverlapHoweverBodiesMove) {
  std::mt19937 random(11);
  const auto anywhere = [&] {
    std::uniform_real_distribution<Scalar> place(-4, 4);
    return Vector(place(random), place(random), place(random));
  };
  Bodies bodies;
  for (std::uint64_t n = 0; n < 40; ++n) bodies.add(1 + (n * 7) % 40, anywhere());
  for (int tick = 0; tick < 200; ++tick) {
    std::uniform_real_distribution<Scalar> step(Scalar(-0.3), Scalar(0.3));
    for (std::size_t n = 0; n < bodies.bodies.size(); ++n) {
      if (random() % 3 == 0) continue;
      const bool jumps = random() % 40 == 0;
      bodies.move(n, jumps ? anywhere()
                           : Vector(bodies.bodies[n].pose.position +
                                    Vector(step(random), step(random), step(random))));
    }
    bodies.find();
    ASSERT_EQ(bodies.near(), bodies.overlapping()) << "tick " << tick;
    ASSERT_TRUE(std::is_sorted(bodies.candidates.begin(), bodies.candidates.end(),
                               [](const Candidate& x, const Candidate& y) { return x.key() < y.key(); }));
    ASSERT_EQ(std::adjacent_find(bodies.candidates.begin(), bodies.candidates.end(),
                                 [](const Candidate& x, const Candidate& y) { return x.key() == y.key(); }),
              bodies.candidates.end())
        << "each pair once";
  }
}

TEST(BroadPhaseTest, ABodyThatStaysInItsEnlargedBoxSearchesForNobody) {
  Bodies bodies;
  bodies.add(1, {0, 0, 0});
  bodies.add(2, {5, 0, 0});
  bodies.find();
  bodies.move(0, {Scalar(0.3), 0, 0});
  EXPECT_TRUE(bodies.bodies[0].has_left);
  bodies.find();
  bodies.move(0, {Scalar(0.35), 0, 0});
  EXPECT_FALSE(bodies.bodies[0].has_left);
}

TEST(BroadPhaseTest, WhatIsRemovedIsNotFound) {
  Bodies bodies;
  bodies.add(1, {0, 0, 0});
  bodies.add(2, {Scalar(0.5), 0, 0});
  bodies.phase.remove(bodies.bodies[1]);
  bodies.find();
  EXPECT_TRUE(bodies.candidates.empty());
}

}  // namespace
}  // namespace tessera::native
