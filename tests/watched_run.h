// A run of the busy world that a client pushes and watches, to be compared with the same run undisturbed.
#pragma once

#include <absl/time/clock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "lpss/model/world_description.h"
#include "tessera/client.h"
#include "tests/cluster_fixture.h"

namespace tessera::testing {

using TickedContact = std::tuple<Tick, ContactPhase, BodyId, BodyId>;

// A push of a body, as a client was told that it takes effect.
struct Push {
  Tick tick;
  BodyId body;
  Eigen::Vector3d impulse;
};

// What a world does in one process with the same pushes.
struct Undisturbed {
  Undisturbed(const WorldDescription& world, const std::vector<Push>& pushes, Tick ticks);

  std::string hash;
  std::vector<TickedContact> contacts;
};

class WatchedRun : public ::testing::Test {
 protected:
  // Loads the world at a cluster, watches it, and lets it run as fast as real time.
  void begin(Client& client);

  // Pushes bodies while the world does so many ticks, and reads both streams.
  void go_on(Tick ticks);
  void read_until(Tick tick);
  // The next tick, if it comes before `end`.
  void read_what_is_there(absl::Time end);
  void expect_as_undisturbed();

  const WorldDescription world_ = read_world("busy.sdf");
  std::vector<BodyId> dynamic_;
  std::unique_ptr<BodyStream> bodies_;
  std::unique_ptr<ContactStream> contacts_;
  std::vector<Push> pushes_;
  std::vector<TickedContact> contacts_told_;
  Tick frames_ = 0;
  absl::Time last_frame_ = absl::Now();
  absl::Duration longest_gap_;
  Tick told_ = 0;
  std::size_t count_ = 0;

 private:
  void take(const BodyFrame& frame);

  Client* client_of_run_ = nullptr;
};

}  // namespace tessera::testing
