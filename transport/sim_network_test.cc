#include "transport/sim_network.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

namespace tessera {
namespace {

constexpr NodeId kNodeA{10};
constexpr NodeId kNodeB{20};
constexpr NodeId kNodeC{30};
constexpr int kMessages = 200;

std::vector<std::string> payloads(const std::vector<Delivery>& deliveries) {
  std::vector<std::string> result;
  for (const Delivery& delivery : deliveries) result.push_back(delivery.payload);
  return result;
}

// Steps until no event is pending; returns what the node of `link` has received, in order of arrival.
std::vector<std::string> run_dry(SimNetwork& network, Link& link) {
  while (network.step()) {
  }
  return payloads(link.receive({}));
}

void send_numbers(Link& from, NodeId to, int count = kMessages) {
  for (int i = 0; i < count; ++i) from.send(to, std::to_string(i));
}

// Makes two nodes know each other.
void acquaint(SimNetwork& network, Link& a, Link& b) {
  a.send(b.self(), "hello");
  run_dry(network, b);
  b.send(a.self(), "hello");
  run_dry(network, a);
}

std::vector<std::string> numbers(int count = kMessages) {
  std::vector<std::string> result;
  for (int i = 0; i < count; ++i) result.push_back(std::to_string(i));
  return result;
}

// Three nodes that answer each message a few times; returns all events as text.
std::vector<std::string> chatter(std::uint64_t seed) {
  SimNetwork network(seed);
  std::map<NodeId, std::unique_ptr<Link>> links;
  for (NodeId node : {kNodeA, kNodeB, kNodeC}) links.emplace(node, network.connect(node));
  send_numbers(*links[kNodeA], kNodeB, 20);
  send_numbers(*links[kNodeA], kNodeC, 20);
  network.set_timer(kNodeC, 500'000);
  std::vector<std::string> log;
  while (auto event = network.step()) {
    log.push_back(std::to_string(event->time_ns) + "@" + std::to_string(event->node.value));
    for (Delivery& delivery : links[event->node]->receive({})) {
      log.push_back(std::to_string(delivery.from.value) + ":" + delivery.payload);
      if (delivery.payload.size() < 5) links[event->node]->send(delivery.from, delivery.payload + "'");
    }
  }
  return log;
}

TEST(SimNetwork, SameSeedSameOrder) {
  EXPECT_EQ(chatter(7), chatter(7));
  EXPECT_NE(chatter(7), chatter(8));
}

TEST(SimNetwork, MessagesOvertakeOneAnotherAndArriveOnce) {
  SimNetwork network(1);
  auto a = network.connect(kNodeA);
  auto b = network.connect(kNodeB);
  send_numbers(*a, kNodeB);
  std::vector<std::string> got = run_dry(network, *b);
  EXPECT_NE(got, numbers());
  std::vector<std::string> expected = numbers();
  std::sort(got.begin(), got.end());
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(got, expected);
  EXPECT_EQ(network.step(), std::nullopt);
}

TEST(SimNetwork, KeepsTheOrderOfAPairWhenAskedTo) {
  SimNetwork network(1, {.reorder = false});
  auto a = network.connect(kNodeA);
  auto b = network.connect(kNodeB);
  send_numbers(*a, kNodeB);
  EXPECT_EQ(run_dry(network, *b), numbers());
}

TEST(SimNetwork, DelaysStayInTheirRangeAndTimeNeverRunsBack) {
  SimNetwork network(3, {.delay_ns_min = 100, .delay_ns_max = 110});
  auto a = network.connect(kNodeA);
  auto b = network.connect(kNodeB);
  acquaint(network, *a, *b);
  const std::uint64_t start_ns = network.now_ns();
  send_numbers(*a, kNodeB);
  std::uint64_t previous_ns = start_ns;
  while (auto event = network.step()) {
    EXPECT_GE(event->time_ns, std::max<std::uint64_t>(previous_ns, start_ns + 100));
    EXPECT_LE(event->time_ns, start_ns + 110);
    EXPECT_EQ(event->time_ns, network.now_ns());
    EXPECT_EQ(b->receive({}).size(), 1u);
    previous_ns = event->time_ns;
  }
}

TEST(SimNetwork, ALateStarterGetsWhatWasSentToIt) {
  SimNetwork network(1);
  auto a = network.connect(kNodeA);
  send_numbers(*a, kNodeB);
  EXPECT_EQ(network.step(), std::nullopt);
  auto b = network.connect(kNodeB);
  EXPECT_EQ(run_dry(network, *b).size(), numbers().size());
}

TEST(SimNetwork, OfAKilledNodeOnlyWhatWasUnderWayArrives) {
  SimNetwork network(1, {.reorder = false});
  auto a = network.connect(kNodeA);
  auto b = network.connect(kNodeB);
  auto c = network.connect(kNodeC);
  acquaint(network, *a, *b);
  acquaint(network, *b, *c);
  send_numbers(*a, kNodeB);
  send_numbers(*b, kNodeC);
  network.set_timer(kNodeB, 1'000);
  network.kill(kNodeB);
  send_numbers(*a, kNodeB);
  b->send(kNodeC, "from beyond");
  while (auto event = network.step()) EXPECT_EQ(event->node, kNodeC);
  EXPECT_TRUE(b->receive({}).empty());
  const std::vector<std::string> got = payloads(c->receive({}));
  EXPECT_LT(got.size(), numbers().size());
  EXPECT_EQ(got, numbers(static_cast<int>(got.size()))) << "the first ones";
}

TEST(SimNetwork, ARestartedNodeGetsWhatWasSentOnceTheLossWasNoticed) {
  SimNetwork network(1, {.lease_ns = 5'000'000});
  auto a = network.connect(kNodeA);
  auto b = network.connect(kNodeB);
  acquaint(network, *a, *b);
  send_numbers(*a, kNodeB);
  b.reset();
  a->send(kNodeB, "unnoticed");
  const auto loss = network.step();
  ASSERT_TRUE(loss);
  EXPECT_EQ(loss->kind, SimEvent::Kind::kLoss);
  a->send(kNodeB, "noticed");
  auto reborn = network.connect(kNodeB);
  a->send(kNodeB, "after");
  std::vector<std::string> got = run_dry(network, *reborn);
  std::sort(got.begin(), got.end());
  EXPECT_EQ(got, (std::vector<std::string>{"after", "noticed"}));
}

// Any packet may be lost, an end may not notice, and packets come twice; messages come once nevertheless.
TEST(SimNetwork, MessagesOutliveConnections) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SimNetwork network(seed, {.reorder = false, .duplicates_one_in = 3});
    auto a = network.connect(kNodeA);
    auto b = network.connect(kNodeB);
    std::vector<std::string> got;
    for (int n = 0; n < kMessages; ++n) {
      a->send(kNodeB, std::to_string(n));
      if (n % 7 == 0) network.break_connection(kNodeA, kNodeB);
      for (int events = 0; events < n % 3 && network.step(); ++events) {
      }
      for (std::string& payload : payloads(b->receive({}))) got.push_back(std::move(payload));
    }
    for (std::string& payload : run_dry(network, *b)) got.push_back(std::move(payload));
    EXPECT_EQ(got, numbers()) << seed;
    EXPECT_GT(network.counts().lost, 0u);
    EXPECT_GT(network.counts().duplicated, 0u);
  }
}

TEST(SimNetwork, AStoppedNodeIsMissedAndGoesOnWithWhatCameMeanwhile) {
  SimNetwork network(1, {.lease_ns = 5'000'000});
  auto a = network.connect(kNodeA);
  auto b = network.connect(kNodeB);
  acquaint(network, *a, *b);
  const std::uint64_t end_ns = network.now_ns() + 20'000'000;
  network.stop(kNodeB, end_ns);
  network.set_timer(kNodeB, 0);
  send_numbers(*a, kNodeB);
  const auto loss = network.step();
  ASSERT_TRUE(loss);
  EXPECT_EQ(loss->kind, SimEvent::Kind::kLoss);
  EXPECT_EQ(loss->node, kNodeA);
  bool timer_expired = false;
  while (auto event = network.step()) {
    EXPECT_GE(event->time_ns, end_ns);
    timer_expired |= event->kind == SimEvent::Kind::kTimer;
  }
  EXPECT_TRUE(timer_expired);
  EXPECT_EQ(b->receive({}).size(), numbers().size());
}

TEST(SimNetwork, AStoppedNodeConnectsAnewAlsoWithNodesThatItHadNotMet) {
  SimNetwork network(1, {.lease_ns = 5'000'000, .connection_ns = 10'000'000});
  auto a = network.connect(kNodeA);
  auto b = network.connect(kNodeB);
  network.stop(kNodeB, 20'000'000);
  network.set_timer(kNodeA, 25'000'000);
  EXPECT_TRUE(run_dry(network, *b).empty());
  a->send(kNodeB, "hello");
  EXPECT_EQ(run_dry(network, *b), std::vector<std::string>{"hello"});
}

TEST(SimNetwork, ABusyNodeIsNotMissed) {
  SimNetwork network(1, {.lease_ns = 5'000'000});
  auto a = network.connect(kNodeA);
  auto b = network.connect(kNodeB);
  acquaint(network, *a, *b);
  network.keep_busy(kNodeB, network.now_ns() + 20'000'000);
  a->send(kNodeB, "later");
  while (auto event = network.step()) EXPECT_NE(event->kind, SimEvent::Kind::kLoss);
  EXPECT_EQ(b->receive({}).size(), 1u);
}

TEST(SimNetwork, ACutLinkKeepsItsMessagesUntilHealed) {
  SimNetwork network(1);
  auto a = network.connect(kNodeA);
  auto b = network.connect(kNodeB);
  auto c = network.connect(kNodeC);
  send_numbers(*a, kNodeB, 50);
  network.cut(kNodeB, kNodeA);
  send_numbers(*a, kNodeB, 50);
  send_numbers(*a, kNodeC, 10);
  EXPECT_TRUE(run_dry(network, *b).empty());
  EXPECT_EQ(c->receive({}).size(), 10u);
  const std::uint64_t healed_ns = network.now_ns();
  network.heal(kNodeA, kNodeB);
  EXPECT_EQ(run_dry(network, *b).size(), 100u);
  EXPECT_GT(network.now_ns(), healed_ns);
  network.heal(kNodeA, kNodeB);
  EXPECT_TRUE(run_dry(network, *b).empty());
}

// The reported losses, in order; ignores all other events.
std::vector<SimEvent> losses_of(SimNetwork& network) {
  std::vector<SimEvent> losses;
  while (auto event = network.step()) {
    if (event->kind == SimEvent::Kind::kLoss) losses.push_back(*event);
  }
  return losses;
}

TEST(SimNetwork, ACutThatOutlastsTheLeaseIsToldAtBothEnds) {
  SimNetwork network(1, {.lease_ns = 5'000'000});
  auto a = network.connect(kNodeA);
  auto b = network.connect(kNodeB);
  auto c = network.connect(kNodeC);
  acquaint(network, *a, *b);
  const std::uint64_t time_ns = network.now_ns() + 5'000'000;
  network.cut(kNodeA, kNodeB);
  const auto loss = SimEvent::Kind::kLoss;
  EXPECT_EQ(losses_of(network),
            (std::vector<SimEvent>{{time_ns, kNodeB, loss, kNodeA}, {time_ns, kNodeA, loss, kNodeB}}));
}

TEST(SimNetwork, ACutOneWayIsToldToTheOneThatHearsNothing) {
  SimNetwork network(1, {.lease_ns = 5'000'000});
  auto a = network.connect(kNodeA);
  auto b = network.connect(kNodeB);
  acquaint(network, *a, *b);
  const std::uint64_t time_ns = network.now_ns() + 5'000'000;
  network.cut_one_way(kNodeA, kNodeB);
  a->send(kNodeB, "lost");
  b->send(kNodeA, "heard");
  EXPECT_EQ(losses_of(network), (std::vector<SimEvent>{{time_ns, kNodeB, SimEvent::Kind::kLoss, kNodeA}}));
  const std::vector<Delivery> heard = a->receive({});
  ASSERT_EQ(heard.size(), 1u);
  EXPECT_EQ(heard[0].payload, "heard");
  EXPECT_TRUE(b->receive({}).empty());
  network.heal(kNodeB, kNodeA);
  EXPECT_TRUE(losses_of(network).empty());
  const std::vector<Delivery> late = b->receive({});
  ASSERT_EQ(late.size(), 1u);
  EXPECT_EQ(late[0].payload, "lost");
}

TEST(SimNetwork, ACutThatIsHealedBeforeIsNotTold) {
  SimNetwork network(1, {.lease_ns = 5'000'000});
  auto a = network.connect(kNodeA);
  auto b = network.connect(kNodeB);
  acquaint(network, *a, *b);
  const std::uint64_t start_ns = network.now_ns();
  network.cut(kNodeA, kNodeB);
  network.set_timer(kNodeA, start_ns + 4'000'000);
  EXPECT_EQ(network.step()->kind, SimEvent::Kind::kTimer);
  network.heal(kNodeA, kNodeB);
  network.cut(kNodeA, kNodeB);
  const std::vector<SimEvent> losses = losses_of(network);
  ASSERT_EQ(losses.size(), 2u);
  EXPECT_EQ(losses[0].time_ns, start_ns + 9'000'000) << "the lease of the second cut";
}

TEST(SimNetwork, AKilledNodeIsToldToThoseThatRunAlsoWhereItIsBackBefore) {
  SimNetwork network(1, {.lease_ns = 5'000'000});
  auto a = network.connect(kNodeA);
  auto b = network.connect(kNodeB);
  acquaint(network, *a, *b);
  b.reset();
  auto reborn = network.connect(kNodeB);
  reborn->send(kNodeA, "here I am");
  const std::vector<SimEvent> losses = losses_of(network);
  ASSERT_EQ(losses.size(), 1u);
  EXPECT_EQ(losses[0].node, kNodeA);
  EXPECT_EQ(losses[0].peer, kNodeB);
}

TEST(SimNetwork, TimersRunOutInOrder) {
  SimNetwork network(1);
  auto a = network.connect(kNodeA);
  auto b = network.connect(kNodeB);
  network.set_timer(kNodeA, 300);
  network.set_timer(kNodeB, 100);
  network.set_timer(kNodeA, 100);
  const auto timer = SimEvent::Kind::kTimer;
  EXPECT_EQ(network.step(), (SimEvent{100, kNodeB, timer}));
  EXPECT_EQ(network.step(), (SimEvent{100, kNodeA, timer}));
  EXPECT_EQ(network.step(), (SimEvent{300, kNodeA, timer}));
  network.set_timer(kNodeB, 5);
  EXPECT_EQ(network.step(), (SimEvent{300, kNodeB, timer}));
  EXPECT_EQ(network.step(), std::nullopt);
}

TEST(SimNetwork, LinksMayOutliveTheNetwork) {
  std::unique_ptr<Link> link;
  {
    SimNetwork network(1);
    link = network.connect(kNodeA);
  }
  link->send(kNodeB, "nobody listens");
  link->wake();
  EXPECT_TRUE(link->receive({}).empty());
  EXPECT_EQ(link->self(), kNodeA);
}

}  // namespace
}  // namespace tessera
