// A server joins a cluster, shows that it lives, misses its coordinator, and ends.
#include "sector_server/sector_server.h"

#include "lpss/base/arithmetic_fingerprint.h"
#include "proto/convert.h"
#include "sector_server/test_server.h"

namespace tessera {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Kind = v1::ClusterMessage::KindCase;

v1::ClusterMessage refusal(const std::string& reason) {
  v1::ClusterMessage message;
  message.mutable_refusal()->set_reason(reason);
  return message;
}

v1::ClusterMessage goodbye() {
  v1::ClusterMessage message;
  message.mutable_goodbye();
  return message;
}

TEST(Joining, BeginsWithAHelloThatSaysWhatTheServerIs) {
  SectorServerOptions options;
  options.precision = Precision::kFloat64;
  options.threads = 3;
  options.stream_address = "127.0.0.1:1";
  TestServer server(kFirst, options);
  server.start();
  const auto hellos = server.take(Kind::kHello);
  ASSERT_EQ(hellos.size(), 1u);
  const v1::Hello& hello = hellos[0].hello();
  EXPECT_EQ(hello.protocol(), kClusterProtocol);
  EXPECT_EQ(hello.layout(), wire_layout());
  EXPECT_EQ(hello.arithmetic(), arithmetic_fingerprint());
  EXPECT_EQ(hello.precision(), to_proto(Precision::kFloat64));
  EXPECT_EQ(hello.threads(), 3u);
  EXPECT_EQ(hello.stream_address(), "127.0.0.1:1");
  EXPECT_FALSE(hello.again());
  EXPECT_FALSE(server.machine.joined());
  EXPECT_FALSE(server.machine.work_left());
  EXPECT_EQ(server.machine.next_deadline(), server.now + seconds(1));
}

TEST(Joining, AServerThatIsWelcomeGivesASignOfLifeEachHeartbeat) {
  TestServer server;
  server.start();
  server.welcome(500);
  EXPECT_TRUE(server.machine.joined());
  EXPECT_EQ(server.machine.next_deadline(), server.now + milliseconds(500));
  for (int n = 0; n < 3; ++n) {
    server.advance(milliseconds(499));
    EXPECT_THAT(server.take(Kind::kReport), IsEmpty());
    server.advance(milliseconds(1));
    const auto reports = server.take(Kind::kReport);
    ASSERT_EQ(reports.size(), 1u);
    EXPECT_EQ(reports[0].report().world(), 0u);
    EXPECT_EQ(reports[0].report().tick(), 0u);
  }
  server.advance(seconds(3600));
  EXPECT_FALSE(server.has_ended()) << "a server without work waits for as long as it takes";
}

TEST(Joining, AHeartbeatIsAMillisecondAtLeastAndAMinuteAtMost) {
  TestServer server;
  server.start();
  server.welcome(0);
  EXPECT_EQ(server.machine.next_deadline(), server.now + milliseconds(1));
  server.welcome(~std::uint64_t{0});
  EXPECT_EQ(server.machine.next_deadline(), server.now + seconds(60));
}

TEST(Joining, EndsWhenNoCoordinatorAnswersInTime) {
  SectorServerOptions options;
  options.join_timeout = seconds(7);
  TestServer server(kFirst, options);
  server.start();
  server.advance(seconds(7) - milliseconds(1));
  EXPECT_FALSE(server.has_ended());
  server.advance(milliseconds(1));
  EXPECT_EQ(server.failure().code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_THAT(std::string(server.failure().message()), HasSubstr("within 7 s"));
}

TEST(Joining, ARefusedServerEndsWithTheReason) {
  TestServer server;
  server.start();
  server.receive(kCoordinatorNode, refusal("too many servers"));
  EXPECT_EQ(server.failure().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(server.failure().message()), HasSubstr("too many servers"));
  EXPECT_EQ(server.take(Kind::kGoodbye).size(), 1u);
}

TEST(Joining, ReportsTheMemoryThatItTookAtMost) {
  SectorServerOptions options;
  int asked = 0;
  options.peak_rss_bytes = [&] { return ++asked * std::uint64_t{1000}; };
  TestServer server(kFirst, options);
  server.start();
  server.welcome(100);
  std::vector<std::uint64_t> seen;
  for (int n = 0; n < 11; ++n) {
    server.advance(milliseconds(100));
    for (const auto& message : server.take(Kind::kReport)) seen.push_back(message.report().peak_rss_bytes());
  }
  ASSERT_EQ(seen.size(), 11u);
  EXPECT_EQ(seen.front(), 1000u);
  EXPECT_EQ(seen.back(), 3000u) << "it is measured twice a second at most";
}

TEST(Ending, AGoodbyeOfTheCoordinatorEndsAServerInOrder) {
  TestServer server;
  server.start();
  server.welcome();
  server.receive(kCoordinatorNode, goodbye());
  ASSERT_TRUE(server.has_ended());
  EXPECT_TRUE(server.failure().ok());
  EXPECT_THAT(server.take(Kind::kGoodbye), IsEmpty()) << "the coordinator knows";
}

TEST(Ending, AServerThatLeavesSaysSoOnce) {
  TestServer server;
  server.start();
  server.welcome();
  server.machine.leave("told to");
  server.machine.leave("told again");
  server.advance(milliseconds(1));
  const auto goodbyes = server.take(Kind::kGoodbye);
  ASSERT_EQ(goodbyes.size(), 1u);
  EXPECT_EQ(goodbyes[0].goodbye().reason(), "told to");
  EXPECT_TRUE(server.has_ended());
  EXPECT_TRUE(server.failure().ok());
}

TEST(Ending, TheFirstReasonStands) {
  TestServer server;
  server.start();
  server.receive(kCoordinatorNode, refusal("first"));
  server.receive(kCoordinatorNode, refusal("second"));
  server.receive(kCoordinatorNode, goodbye());
  server.advance(seconds(60));
  EXPECT_THAT(std::string(server.failure().message()), HasSubstr("first"));
  EXPECT_EQ(server.take(Kind::kGoodbye).size(), 1u);
}

TEST(Joined, MessagesThatAreNotForServersAreIgnored) {
  TestServer server;
  server.start();
  server.welcome();
  v1::ClusterMessage message;
  server.receive(kCoordinatorNode, message);
  message.mutable_hello();
  server.receive(kCoordinatorNode, message);
  EXPECT_THAT(server.log, Contains(HasSubstr("not meant for sector servers")).Times(2));
  EXPECT_FALSE(server.has_ended());
}

class LostCoordinator : public testing::Test {
 protected:
  LostCoordinator() : server_(kFirst, options()) {
    server_.start();
    server_.welcome(500);
    server_.take(Kind::kHello);
  }

  static SectorServerOptions options() {
    SectorServerOptions options;
    options.coordinator_timeout = seconds(4);
    return options;
  }

  TestServer server_;
};

TEST_F(LostCoordinator, IsAskedWhetherItStillHasTheServer) {
  server_.suspect(kCoordinatorNode);
  EXPECT_FALSE(server_.machine.joined());
  const auto hellos = server_.take(Kind::kHello);
  ASSERT_EQ(hellos.size(), 1u);
  EXPECT_TRUE(hellos[0].hello().again());
  EXPECT_THAT(server_.log, Contains(HasSubstr("not responding")));
  server_.suspect(kCoordinatorNode);
  EXPECT_THAT(server_.take(Kind::kHello), IsEmpty()) << "once is enough";
}

TEST_F(LostCoordinator, EndsTheServerWhenItsTimeIsUp) {
  server_.suspect(kCoordinatorNode);
  server_.advance(seconds(2));
  server_.suspect(kCoordinatorNode);  // gives it no more time
  server_.advance(seconds(2) - milliseconds(1));
  EXPECT_FALSE(server_.has_ended());
  EXPECT_EQ(server_.machine.next_deadline(), server_.now + milliseconds(1));
  server_.advance(milliseconds(1));
  EXPECT_EQ(server_.failure().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(server_.failure().message()), HasSubstr("for 4 s"));
}

TEST_F(LostCoordinator, IsBackWithAnyMessageOfItsOwn) {
  server_.suspect(kCoordinatorNode);
  server_.welcome(500);
  EXPECT_TRUE(server_.machine.joined());
  server_.advance(seconds(60));
  EXPECT_FALSE(server_.has_ended());
  server_.suspect(kCoordinatorNode);
  server_.grant(grant_of(1, 1));
  EXPECT_TRUE(server_.machine.joined());
}

TEST_F(LostCoordinator, IsToldThatItIsNotHeardAndThatItIsAgain) {
  server_.suspect(kCoordinatorNode);
  auto reports = server_.take(Kind::kReport);
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_TRUE(reports[0].report().deaf());
  server_.welcome(500);
  server_.advance(milliseconds(0));
  reports = server_.take(Kind::kReport);
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_FALSE(reports[0].report().deaf());
}

TEST_F(LostCoordinator, IsNotBackWithAMessageOfAPeer) {
  server_.suspect(kCoordinatorNode);
  v1::ClusterMessage round;
  round.mutable_round()->set_world(kWorld);
  server_.receive(kSecond, round);
  EXPECT_FALSE(server_.machine.joined());
}

TEST_F(LostCoordinator, DoesNotKeepGrantedTicksFromBeingDone) {
  server_.load(loads_of(small_tower(), {kFirst})[0]);
  server_.grant(grant_of(1, 5));
  server_.suspect(kCoordinatorNode);
  server_.work();
  EXPECT_EQ(server_.machine.tick(), 5u);
}

TEST_F(LostCoordinator, IsNoneBeforeThereWasOneAndNoneOfThePeers) {
  server_.suspect(kSecond);
  EXPECT_TRUE(server_.machine.joined());
  TestServer newcomer;
  newcomer.start();
  newcomer.take(Kind::kHello);
  newcomer.suspect(kCoordinatorNode);
  EXPECT_THAT(newcomer.take(Kind::kHello), IsEmpty());
  newcomer.welcome();
  EXPECT_TRUE(newcomer.machine.joined());
}

}  // namespace
}  // namespace tessera
