// Streams over real gRPC on loopback.
#include "sector_server/streams.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <list>
#include <optional>
#include <semaphore>
#include <string>

#include "proto/stream_limits.h"
#include "sector_server/test_server.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

class StreamsTest : public ::testing::Test {
 protected:
  struct Call {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReader<v1::BodyBatch>> reader;
  };

  StreamsTest() {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&streams_);
    server_ = builder.BuildAndStart();
    stub_ = v1::Streams::NewStub(
        grpc::CreateChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials()));
  }
  ~StreamsTest() override {
    for (Call& call : calls_) call.context.TryCancel();
    streams_.shut_down();
    server_->Shutdown();
  }

  Call& watch(int ids, std::uint64_t subscription = 0) {
    v1::WatchBodiesRequest request;
    request.set_subscription(subscription);
    for (int n = 0; n < ids; ++n) request.add_ids(static_cast<std::uint64_t>(n) + 1);
    Call& call = calls_.emplace_back();
    call.context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(1));
    call.reader = stub_->WatchBodies(&call.context, request);
    return call;
  }
  static grpc::Status end_of(Call& call) {
    v1::BodyBatch batch;
    while (call.reader->Read(&batch)) {
    }
    return call.reader->Finish();
  }

  std::counting_semaphore<> claimed_{0};
  Streams streams_{NodeId{1}, [this] { claimed_.release(); }};
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<v1::Streams::Stub> stub_;
  std::list<Call> calls_;
};

TEST_F(StreamsTest, IdsAreBoundedInAll) {
  for (int n = 0; n < kAllWatchedIdsMax / kWatchedIdsMax; ++n) {
    watch(kWatchedIdsMax);
    claimed_.acquire();
  }
  const grpc::Status refused = end_of(watch(1));
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("ids: with these 1"));
  EXPECT_THAT(refused.error_message(), HasSubstr("more than 1000000"));
  watch(0);  // all bodies
  claimed_.acquire();
  const std::optional<v1::Subscriptions> told = streams_.changed_subscriptions();
  ASSERT_TRUE(told.has_value());
  EXPECT_LT(told->ByteSizeLong(), std::size_t{16} << 20) << "what servers tell each other";
}

TEST_F(StreamsTest, IdsAreBoundedInEach) {
  const grpc::Status refused = end_of(watch(kWatchedIdsMax + 1));
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.error_message(), HasSubstr("ids: 100001 must be at most 100000"));
}

// One that was given up and comes back does not go on with the stream that its client is about to leave: what
// it tells from its first tick on waits for the client's next call.
TEST_F(StreamsTest, OfAServerThatComesBackBeginAnew) {
  Call& before = watch(0, 7);
  claimed_.acquire();
  ASSERT_TRUE(streams_.changed_subscriptions().has_value());
  v1::LoadWorld load;
  load.mutable_guest();
  streams_.begin_world(load);
  NewServers servers{.since = 5, .servers = 2, .subscriptions = {}};
  servers.subscriptions.emplace_back().mutable_bodies()->set_subscription(7);
  streams_.change_servers(servers);
  EXPECT_TRUE(end_of(before).ok());
  const std::optional<v1::Subscriptions> told = streams_.changed_subscriptions();
  ASSERT_TRUE(told.has_value());
  EXPECT_EQ(told->all_size(), 1);
  claimed_.acquire();  // the stream that ended
  watch(0, 7);
  claimed_.acquire();
  EXPECT_FALSE(streams_.changed_subscriptions().has_value()) << "it takes the one that waits";
}

// Others may have told of the tick only after the change: what moved would be told by nobody.
TEST_F(StreamsTest, WhatWasToldBetweenTicksIsToldAgainOnceSectorsHaveMoved) {
  TestServer server;
  server.start();
  server.welcome();
  server.load(loads_of(small_tower(), {kFirst})[0]);
  TickMachine* const machine = server.machine.machine_between_ticks();
  ASSERT_NE(machine, nullptr);
  Call& call = watch(0);
  claimed_.acquire();
  v1::BodyBatch batch;
  const auto show = [&] { streams_.publish(0, *machine, /*new_only=*/true); };
  show();
  ASSERT_TRUE(call.reader->Read(&batch));
  EXPECT_EQ(batch.source().since(), 0u);
  const int bodies = batch.bodies_size();
  EXPECT_GT(bodies, 0);
  streams_.change_servers({.since = 1, .servers = 2, .subscriptions = {}});
  show();
  show();  // nothing: it is told once
  ASSERT_TRUE(call.reader->Read(&batch));
  EXPECT_EQ(batch.tick(), 0u);
  EXPECT_EQ(batch.source().since(), 1u);
  EXPECT_TRUE(batch.whole());
  EXPECT_EQ(batch.bodies_size(), bodies);
  streams_.publish(1, *machine, /*new_only=*/false);
  streams_.change_servers({.since = 2, .servers = 2, .subscriptions = {}});
  show();  // nothing: it has been told of a tick
  streams_.publish(2, *machine, /*new_only=*/false);
  for (const Tick tick : {Tick{1}, Tick{2}}) {
    ASSERT_TRUE(call.reader->Read(&batch));
    EXPECT_EQ(batch.tick(), tick);
  }
}

}  // namespace
}  // namespace tessera
