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
  // Loads the world at a cluster, in the place of one that is there, watches it, and lets it run as fast as
  // real time.
  void begin(Client& client);
  // Likewise from `tick` on, for a world that was set back to that tick and is paused: what clients did and
  // saw since then is forgotten.
  void begin_again(Tick tick);

  // Pushes bodies while the world does so many ticks, and reads both streams.
  void go_on(Tick ticks);
  void read_until(Tick tick);
  // The next tick, if it comes before `end`.
  void read_what_is_there(absl::Time end);
  // Pauses the world, once there is a coordinator.
  absl::StatusOr<Tick> pause();
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

  absl::Duration patience_ = kPatience;  // for an answer, or the next tick
  // Called now and then while there is no tick.
  virtual void look_after() {}

  // For a drill in which coordinator and servers are lost at the same moment: streams may miss ticks then, or
  // end.
  bool may_miss_ticks_ = false;
  Tick missed_ = 0;
  int reopened_ = 0;
  bool watches_contacts_ = true;  // which are compared only where no tick was missed

 private:
  void take(const BodyFrame& frame);
  void reopen();

  bool is_reopened_ = false;

  Client* client_of_run_ = nullptr;
};

}  // namespace tessera::testing
