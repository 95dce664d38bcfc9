// Filters of contacts, on a pile that falls.
#include "sector_server/watched_contacts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "lpss/observe/state.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

constexpr int kPiled = 24;
constexpr std::uint32_t kMarkedCategory = 4;
using Pair = std::pair<BodyId, BodyId>;

class WatchedContactsTest : public testing::Test {
 protected:
  WatchedContactsTest() {
    WorldDescription world = pile_world({}, kPiled);
    for (BodyDescription& body : world.bodies) {
      if (body.name == "body3" || body.name == "body5") body.properties.category = kMarkedCategory | 1;
    }
    simulation_ = Simulation::create(world).value();
    simulation_->report_contacts(true);
  }

  // Of `ticks` ticks, what is found, and what all patches say.
  template <typename Check>
  void run(const v1::WatchContactsRequest& request, int ticks, const Check& check) {
    const WatchedContacts watched(request);
    for (int tick = 0; tick < ticks; ++tick) {
      simulation_->step();
      check(watched.among(simulation_->contact_events(), simulation_->partition()),
            simulation_->contact_events());
    }
  }
  bool is_marked(BodyId id) const {
    const std::optional<BodyRecord> body = body_of(simulation_->partition(), id);
    return body && (body->properties.category & kMarkedCategory) != 0;
  }

  std::unique_ptr<Simulation> simulation_;
};

TEST_F(WatchedContactsTest, WithoutAFilterAreThoseThatBeginAndEnd) {
  std::size_t found_in_all = 0;
  run({}, 60, [&](const auto& found, const auto& all) {
    std::size_t expected = 0;
    for (const ContactEvent& event : all) expected += event.phase == ContactPhase::kPersist ? 0 : 1;
    ASSERT_EQ(found.size(), expected);
    found_in_all += expected;
  });
  EXPECT_GT(found_in_all, 10u);
}

TEST_F(WatchedContactsTest, AMaskMeansEitherBody) {
  v1::WatchContactsRequest request;
  request.set_mask(kMarkedCategory);
  request.set_persisting(true);
  std::size_t found_in_all = 0;
  run(request, 60, [&](const auto& found, const auto& all) {
    std::size_t expected = 0;
    for (const ContactEvent& event : all) expected += is_marked(event.a) || is_marked(event.b) ? 1 : 0;
    ASSERT_EQ(found.size(), expected);
    found_in_all += expected;
  });
  EXPECT_GT(found_in_all, 10u);
}

TEST_F(WatchedContactsTest, AnImpulseIsThatOfAPairInATick) {
  constexpr double kLeast = 0.5;
  v1::WatchContactsRequest request;
  request.set_impulse_min(kLeast);
  std::set<ContactPhase> phases;
  run(request, 90, [&](const auto& found, const auto& all) {
    std::map<Pair, double> sums;
    for (const ContactEvent& event : all) sums[{event.a, event.b}] += event.impulse;
    std::set<Pair> expected;
    for (const auto& [pair, sum] : sums) {
      if (sum >= kLeast) expected.insert(pair);
    }
    std::set<Pair> told;
    for (const ContactEvent* event : found) {
      told.insert({event->a, event->b});
      phases.insert(event->phase);
    }
    ASSERT_EQ(told, expected);
  });
  EXPECT_FALSE(phases.empty());
  EXPECT_FALSE(phases.contains(ContactPhase::kEnd));
}

TEST_F(WatchedContactsTest, ImpulsesHaveBounds) {
  v1::WatchContactsRequest request;
  EXPECT_TRUE(check_contacts(request).ok());
  for (const double least : {-1.0, 2e12, std::numeric_limits<double>::quiet_NaN()}) {
    request.set_impulse_min(least);
    EXPECT_EQ(check_contacts(request).code(), absl::StatusCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace tessera
