#include "transport/dds_link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "keys/keys_folder.h"
#include "keys/test_keys.h"

extern char** environ;

namespace tessera {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Clock = std::chrono::steady_clock;
using testing::HasSubstr;

// Deadline of every wait: long, for busy hosts and sanitizers.
constexpr seconds kPatience{60};

// Test programs that run at the same time must not interfere: each has its own cluster, and most their own
// domain.
std::uint32_t domain() { return static_cast<std::uint32_t>(getpid() % 100); }
std::string cluster() { return "test-" + std::to_string(getpid()); }

std::unique_ptr<DdsLink> open_link(NodeId self, const std::string& of = cluster(), DdsNetwork network = {}) {
  auto link =
      DdsLink::create({.domain = domain(), .cluster = of, .network = std::move(network), .self = self});
  if (!link.ok()) ADD_FAILURE() << link.status();
  return link.ok() ? *std::move(link) : nullptr;
}

// A process of dds_link_test_peer; killed on destruction if it still runs.
class PeerProcess {
 public:
  PeerProcess(NodeId self, std::vector<std::string> arguments, const std::string& keys = "") {
    setenv("TESSERA_TEST_KEYS", keys.c_str(), 1);
    std::vector<std::string> all = {TESSERA_TEST_PEER, std::to_string(domain()), cluster(),
                                    std::to_string(self.value)};
    all.insert(all.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& argument : all) argv.push_back(argument.data());
    argv.push_back(nullptr);
    if (posix_spawn(&pid_, TESSERA_TEST_PEER, nullptr, nullptr, argv.data(), environ) != 0) pid_ = 0;
    EXPECT_NE(pid_, 0);
  }
  PeerProcess(const PeerProcess&) = delete;
  ~PeerProcess() {
    if (pid_ == 0) return;
    signal(SIGKILL);
    wait();
  }

  void signal(int number) const { ::kill(pid_, number); }

  // The exit code, or minus the signal that ended it.
  int wait() {
    int status = 0;
    waitpid(std::exchange(pid_, 0), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

 private:
  pid_t pid_ = 0;
};

// Receives until `done` returns true for all messages so far.
std::vector<Delivery> receive_until(DdsLink& link,
                                    const std::function<bool(const std::vector<Delivery>&)>& done) {
  const Clock::time_point deadline = Clock::now() + kPatience;
  std::vector<Delivery> all;
  while (!done(all)) {
    if (Clock::now() >= deadline) {
      ADD_FAILURE() << "nothing more after " << all.size() << " messages";
      break;
    }
    for (Delivery& delivery : link.receive(deadline)) all.push_back(std::move(delivery));
  }
  return all;
}

std::vector<Delivery> receive_count(DdsLink& link, std::size_t count) {
  return receive_until(link, [count](const auto& all) { return all.size() >= count; });
}

std::vector<NodeId> wait_for_loss(DdsLink& link) {
  const Clock::time_point deadline = Clock::now() + kPatience;
  while (Clock::now() < deadline) {
    link.receive(deadline);
    if (std::vector<NodeId> lost = link.take_lost_peers(); !lost.empty()) return lost;
  }
  return {};
}

std::string pattern(std::size_t size) {
  std::string result(size, '\0');
  std::uint32_t state = 1;
  for (char& c : result) {
    state = state * 1664525 + 1013904223;
    c = static_cast<char>(state >> 24);
  }
  return result;
}

void send_and_expect_echo(DdsLink& link, NodeId peer, const std::string& payload) {
  link.send(peer, payload);
  const std::vector<Delivery> answer = receive_count(link, 1);
  ASSERT_EQ(answer.size(), 1u);
  EXPECT_EQ(answer[0].from, peer);
  EXPECT_TRUE(answer[0].payload == payload);
}

constexpr NodeId kSelf{2};
constexpr NodeId kOther{3};

TEST(DdsLink, TwoLinksInOneProcessKeepOrder) {
  auto a = open_link(kSelf);
  auto b = open_link(kOther);
  constexpr int kCount = 1000;
  for (int i = 0; i < kCount; ++i) a->send(kOther, std::to_string(i));
  b->send(kSelf, "");
  // Both ends must run: the first messages wait for the other's answer.
  std::thread other([&] {
    const std::vector<Delivery> got = receive_count(*b, kCount);
    ASSERT_EQ(got.size(), static_cast<std::size_t>(kCount));
    for (int i = 0; i < kCount; ++i) {
      EXPECT_EQ(got[i].from, kSelf);
      EXPECT_EQ(got[i].payload, std::to_string(i));
    }
    b->send(kSelf, "all");
  });
  const std::vector<Delivery> got = receive_count(*a, 2);
  other.join();
  ASSERT_EQ(got.size(), 2u);
  EXPECT_EQ(got[0].payload, "");
  EXPECT_EQ(got[1].payload, "all");
}

// Two clusters in which the same addresses exchange different messages, until all have arrived.
TEST(DdsLink, OtherClustersAreNotHeard) {
  auto a = open_link(kSelf);
  auto b = open_link(kOther);
  auto stranger_a = open_link(kSelf, cluster() + "-another");
  auto stranger_b = open_link(kOther, cluster() + "-another");
  a->send(kOther, "hello");
  b->send(kSelf, "hello");
  stranger_a->send(kOther, "psst");
  stranger_b->send(kSelf, "psst");
  std::thread other([&] { EXPECT_EQ(receive_count(*b, 1)[0].payload, "hello"); });
  std::thread stranger_other([&] { EXPECT_EQ(receive_count(*stranger_b, 1)[0].payload, "psst"); });
  EXPECT_EQ(receive_count(*a, 1)[0].payload, "hello");
  EXPECT_EQ(receive_count(*stranger_a, 1)[0].payload, "psst");
  other.join();
  stranger_other.join();
  b->send(kSelf, "bye");
  EXPECT_EQ(receive_count(*a, 1)[0].payload, "bye");
}

// The bus with keys: who has none, or those of another cluster, neither hears nor is heard.
TEST(DdsLink, StrangersAreOutsideAClosedBus) {
  const TestKeys keys;
  const TestKeys others;
  const auto folder = [](const TestKeys& of) { return (of.folder() / kDaemonFolder).string(); };
  const PeerProcess open(NodeId{2}, {"echo"});
  const PeerProcess foreign(NodeId{3}, {"echo"}, folder(others));
  const PeerProcess own(NodeId{4}, {"echo"}, folder(keys));
  const auto link = open_link(NodeId{1}, cluster(), {.keys = folder(keys)});
  ASSERT_TRUE(link);
  for (const NodeId stranger : {NodeId{2}, NodeId{3}}) link->send(stranger, "for nobody else");
  for (int n = 0; n < 20; ++n) send_and_expect_echo(*link, NodeId{4}, pattern(200'000));
}

TEST(DdsLink, KeysThatAreNoneAreAnError) {
  const TestKeys keys;
  std::filesystem::remove(keys.folder() / kDaemonFolder / kGovernanceFile);
  EXPECT_FALSE(DdsLink::create({.domain = domain(),
                                .cluster = cluster(),
                                .network = {.keys = (keys.folder() / kDaemonFolder).string()},
                                .self = NodeId{1}})
                   .ok());
}

TEST(DdsLink, RefusesOptionsOutOfBounds) {
  using absl::StatusCode;
  EXPECT_EQ(DdsLink::create({.domain = 233, .self = kSelf}).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(DdsLink::create({.cluster = "", .self = kSelf}).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(DdsLink::create({.cluster = std::string(65, 'x'), .self = kSelf}).status().code(),
            StatusCode::kInvalidArgument);
}

TEST(DdsLink, ALateProcessGetsWhatWasSentBeforeItStarted) {
  auto link = open_link(kSelf);
  constexpr int kCount = 300;
  for (int i = 0; i < kCount; ++i) link->send(kOther, std::to_string(i));
  EXPECT_TRUE(link->receive(Clock::now()).empty());
  PeerProcess peer(kOther, {"echo"});
  const std::vector<Delivery> got = receive_count(*link, kCount);
  ASSERT_EQ(got.size(), static_cast<std::size_t>(kCount));
  for (int i = 0; i < kCount; ++i) EXPECT_EQ(got[i].payload, std::to_string(i));
  link->send(kOther, "quit");
  EXPECT_EQ(wait_for_loss(*link), std::vector<NodeId>{kOther});
  EXPECT_EQ(peer.wait(), 0);
}

TEST(DdsLink, CarriesLargePayloads) {
  auto link = open_link(kSelf);
  PeerProcess peer(kOther, {"echo"});
  for (std::size_t size :
       {std::size_t{0}, std::size_t{65'536}, std::size_t{262'145}, std::size_t{100'000'000}}) {
    send_and_expect_echo(*link, kOther, pattern(size));
  }
}

TEST(DdsLink, CarriesManySamplesBothWays) {
  auto link = open_link(kSelf);
  PeerProcess peer(kOther, {"echo"});
  constexpr std::size_t kCount = 5000;
  const std::string payload = pattern(16 * 1024);
  for (std::size_t i = 0; i < kCount; ++i) link->send(kOther, payload + std::to_string(i));
  const std::vector<Delivery> got = receive_count(*link, kCount);
  ASSERT_EQ(got.size(), kCount);
  for (std::size_t i = 0; i < kCount; ++i) {
    ASSERT_EQ(got[i].payload.substr(payload.size()), std::to_string(i));
  }
}

// Small messages go through shared memory, large ones do not: they keep their order.
TEST(DdsLink, SmallAndLargeMessagesKeepOrder) {
  auto link = open_link(kSelf);
  PeerProcess peer(kOther, {"echo"});
  send_and_expect_echo(*link, kOther, "introduced");
  constexpr std::size_t kCount = 300;
  const std::string large = pattern(500'000);
  const auto payload = [&](std::size_t n) { return (n % 7 == 3 ? large : "") + std::to_string(n); };
  for (std::size_t n = 0; n < kCount; ++n) link->send(kOther, payload(n));
  const std::vector<Delivery> got = receive_count(*link, kCount);
  ASSERT_EQ(got.size(), kCount);
  for (std::size_t n = 0; n < kCount; ++n) ASSERT_TRUE(got[n].payload == payload(n)) << n;
}

TEST(DdsLink, CarriesTheSameWithoutSharedMemory) {
  auto link = open_link(kSelf, cluster(), {.shared_memory = false});
  PeerProcess peer(kOther, {"echo"});
  for (std::size_t n = 0; n < 500; ++n) send_and_expect_echo(*link, kOther, pattern(n * 97));
}

// The other end sleeps between two messages, and looks for the next one without sleeping: both must wake.
TEST(DdsLink, AnswersComeWhetherTheOtherSleepsOrNot) {
  auto link = open_link(kSelf);
  PeerProcess peer(kOther, {"echo"});
  const Clock::time_point deadline = Clock::now() + kPatience;
  for (int n = 0; n < 3000; ++n) {
    link->send(kOther, std::to_string(n));
    std::vector<Delivery> answer;
    while (answer.empty() && Clock::now() < deadline) {
      answer = link->receive(deadline, std::chrono::microseconds(n % 3 * 100));
    }
    ASSERT_EQ(answer.size(), 1u);
    ASSERT_EQ(answer[0].payload, std::to_string(n));
  }
}

TEST(DdsLink, WakeEndsReceive) {
  auto link = open_link(kSelf);
  const Clock::time_point never = Clock::time_point::max();
  link->wake();
  EXPECT_TRUE(link->receive(never).empty());
  std::promise<void> about_to_wait;
  std::thread waker([&] {
    about_to_wait.get_future().wait();
    link->wake();
  });
  about_to_wait.set_value();
  EXPECT_TRUE(link->receive(never).empty());
  waker.join();
  // Both wake-ups have been consumed.
  const Clock::time_point soon = Clock::now() + milliseconds(20);
  EXPECT_TRUE(link->receive(soon).empty());
  EXPECT_GE(Clock::now(), soon);
}

TEST(DdsLink, AKilledProcessIsNoticedAndItsSuccessorIsServed) {
  auto link = open_link(kSelf);
  auto peer = std::make_unique<PeerProcess>(kOther, std::vector<std::string>{"echo"});
  send_and_expect_echo(*link, kOther, "first");
  peer->signal(SIGKILL);
  EXPECT_EQ(peer->wait(), -SIGKILL);
  link->send(kOther, "to the dead");
  EXPECT_EQ(wait_for_loss(*link), std::vector<NodeId>{kOther});
  link->send(kOther, "to the next");
  peer = std::make_unique<PeerProcess>(kOther, std::vector<std::string>{"echo"});
  EXPECT_EQ(receive_count(*link, 1)[0].payload, "to the next");
}

TEST(DdsLink, AReplacementThatComesBeforeTheLeaseEndsIsALoss) {
  auto link = open_link(kSelf);
  auto peer = std::make_unique<PeerProcess>(kOther, std::vector<std::string>{"echo"});
  send_and_expect_echo(*link, kOther, "first");
  peer->signal(SIGKILL);
  peer = std::make_unique<PeerProcess>(kOther, std::vector<std::string>{"echo"});
  EXPECT_EQ(wait_for_loss(*link), std::vector<NodeId>{kOther});
  send_and_expect_echo(*link, kOther, "second");
  EXPECT_TRUE(link->take_lost_peers().empty());
}

TEST(DdsLink, AStalledProcessThatComesBackHasMissedNothing) {
  auto link = open_link(kSelf);
  PeerProcess peer(kOther, {"echo"});
  send_and_expect_echo(*link, kOther, "first");
  constexpr std::size_t kCount = 2000;
  const std::string payload = pattern(16 * 1024);
  const auto send_half = [&](std::size_t begin) {
    for (std::size_t i = begin; i < begin + kCount / 2; ++i) link->send(kOther, payload + std::to_string(i));
  };
  send_half(0);
  peer.signal(SIGSTOP);
  EXPECT_EQ(wait_for_loss(*link), std::vector<NodeId>{kOther});
  send_half(kCount / 2);
  peer.signal(SIGCONT);
  // wait_for_loss() took the messages before the loss was reported: check the last ones.
  const std::vector<Delivery> got = receive_until(*link, [&](const std::vector<Delivery>& all) {
    return !all.empty() && all.back().payload == payload + std::to_string(kCount - 1);
  });
  ASSERT_GE(got.size(), kCount / 2);
  for (std::size_t i = 0; i < got.size(); ++i) {
    ASSERT_TRUE(got[i].payload == payload + std::to_string(kCount - got.size() + i)) << i;
  }
}

TEST(DdsLink, ThirtyTwoProcessesFindOneAnother) {
  constexpr std::uint64_t kFirst = 101;
  constexpr std::uint64_t kLast = 132;
  auto link = open_link(kCoordinatorNode);
  std::map<NodeId, std::unique_ptr<PeerProcess>> peers;
  for (std::uint64_t node = kFirst; node <= kLast; ++node) {
    peers.emplace(NodeId{node}, std::make_unique<PeerProcess>(
                                    NodeId{node}, std::vector<std::string>{"mesh", std::to_string(kFirst),
                                                                           std::to_string(kLast)}));
  }
  std::set<NodeId> complete;
  for (const Delivery& delivery : receive_count(*link, peers.size())) {
    EXPECT_EQ(delivery.payload, "complete");
    complete.insert(delivery.from);
  }
  EXPECT_EQ(complete.size(), peers.size());
  for (const auto& [node, peer] : peers) link->send(node, "quit");
  std::set<NodeId> gone;
  while (gone.size() < peers.size() && !testing::Test::HasFailure()) {
    const std::vector<NodeId> lost = wait_for_loss(*link);
    ASSERT_FALSE(lost.empty());
    gone.insert(lost.begin(), lost.end());
  }
  for (const auto& [node, peer] : peers) EXPECT_EQ(peer->wait(), 0);
}

TEST(DdsLink, ASecondCoordinatorIsRefused) {
  auto link = open_link(kSelf);
  auto first = std::make_unique<PeerProcess>(NodeId{10}, std::vector<std::string>{"coordinate"});
  EXPECT_EQ(receive_count(*link, 1)[0].payload, "OK");
  PeerProcess second(NodeId{11}, {"coordinate"});
  const std::string refusal = receive_count(*link, 1)[0].payload;
  EXPECT_THAT(refusal, HasSubstr("ALREADY_EXISTS"));
  EXPECT_THAT(refusal, HasSubstr("here:10"));
  // A process that never knew the killed coordinator may take its place at once.
  first->signal(SIGKILL);
  first->wait();
  PeerProcess third(NodeId{12}, {"coordinate"});
  EXPECT_EQ(receive_count(*link, 1)[0].payload, "OK");
}

TEST(DdsLink, OfTwoCoordinatorsAtOnceOneServes) {
  auto link = open_link(kSelf);
  PeerProcess one(NodeId{10}, {"coordinate"});
  PeerProcess two(NodeId{11}, {"coordinate"});
  int accepted = 0;
  for (const Delivery& delivery : receive_count(*link, 2)) accepted += delivery.payload == "OK" ? 1 : 0;
  EXPECT_EQ(accepted, 1);
}

TEST(DdsLink, LeavesNoThreadAndNoFileBehind) {
  const auto threads = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/task"), {});
  };
  const auto shared_memory = [] {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator("/dev/shm")) names.insert(entry.path());
    return names;
  };
  // Sanitizer runtimes start their own thread with the program's first.
  std::thread([] {}).join();
  const auto threads_before = threads();
  const auto shared_before = shared_memory();
  {
    auto a = open_link(kSelf);
    auto b = open_link(kOther);
    a->send(kOther, "never answered");
    EXPECT_GT(threads(), threads_before);
  }
  EXPECT_EQ(threads(), threads_before);
  EXPECT_EQ(shared_memory(), shared_before);
}

}  // namespace
}  // namespace tessera
