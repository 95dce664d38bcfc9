// The service over real gRPC on loopback, with a hand in the place of the state machine.
#include "coordinator/service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <map>
#include <semaphore>
#include <thread>

#include "coordinator/client_edge.h"
#include "coordinator/limits.h"
#include "coordinator/test_requests.h"
#include "proto/status.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

constexpr std::chrono::seconds kPatience{60};  // for machines that are busy

class Service : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = ClientEdge::open("127.0.0.1:0", std::nullopt, queue_);
    ASSERT_TRUE(opened.ok()) << opened.status();
    edge_ = std::move(*opened);
    channel_ = grpc::CreateChannel(edge_->address(), grpc::InsecureChannelCredentials());
    stub_ = v1::Tessera::NewStub(channel_);
  }

  // Waits for the next request.
  ClientRequest next() {
    for (;;) {
      std::vector<ClientRequest> requests = queue_.take();
      if (!requests.empty()) return std::move(requests.front());
      pushed_.acquire();
    }
  }

  // Closing waits for every call that is still under way here, whatever its client has been told.
  void expect_call_has_ended() {
    std::future<void> closed = std::async(std::launch::async, [&] { edge_->close(); });
    EXPECT_EQ(closed.wait_for(kPatience), std::future_status::ready) << "the call is still open";
    if (!HasFailure()) return;
    // Lets the test end.
    for (ClientRequest& request : unanswered_) {
      std::visit([](auto& call) { call.reply(absl::OkStatus(), {}); }, request);
    }
  }

  std::vector<ClientRequest> unanswered_;
  std::counting_semaphore<> pushed_{0};
  RequestQueue queue_{[this] { pushed_.release(); }};
  std::unique_ptr<ClientEdge> edge_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::Tessera::Stub> stub_;
};

using RequestCall = ClientCall<v1::Request, v1::Reply>;

TEST_F(Service, CarriesRequestsAndReplies) {
  auto client = std::async(std::launch::async, [&] {
    grpc::ClientContext context;
    v1::Reply reply;
    EXPECT_TRUE(stub_->Do(&context, request_of({}, 7), &reply).ok());
    return reply.tick();
  });
  ClientRequest request = next();
  auto& call = std::get<RequestCall>(request);
  EXPECT_EQ(call.request.ticks(), 7u);
  EXPECT_EQ(call.id.session, 0u) << "a request of no session";
  v1::Reply answer;
  answer.set_tick(99);
  call.reply(absl::OkStatus(), answer);
  EXPECT_EQ(client.get(), 99u);
}

TEST_F(Service, CarriesStatuses) {
  auto client = std::async(std::launch::async, [&] {
    grpc::ClientContext context;
    v1::Reply reply;
    return stub_->Do(&context, request_of({removal("ball")}), &reply);
  });
  ClientRequest request = next();
  std::get<RequestCall>(request).reply(absl::NotFoundError("no such body" + std::string(100'000, '!')), {});
  const grpc::Status status = client.get();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("no such body"));
}

TEST_F(Service, AddsTheMemoryOfTheProcessToItsStatus) {
  auto client = std::async(std::launch::async, [&] {
    grpc::ClientContext context;
    v1::StatusReply reply;
    EXPECT_TRUE(stub_->GetStatus(&context, v1::StatusRequest(), &reply).ok());
    return reply;
  });
  ClientRequest request = next();
  std::get<ClientCall<v1::StatusRequest, v1::StatusReply>>(request).reply(absl::OkStatus(), {});
  EXPECT_GT(client.get().coordinator_peak_rss_bytes(), 0u);
}

TEST_F(Service, AClientThatVanishesLeavesNothingBehind) {
  grpc::ClientContext context;
  auto client = std::async(std::launch::async, [&] {
    v1::PauseReply reply;
    return stub_->Pause(&context, v1::PauseRequest(), &reply);
  });
  unanswered_.push_back(next());
  context.TryCancel();
  EXPECT_EQ(client.get().error_code(), grpc::StatusCode::CANCELLED);
  expect_call_has_ended();
  // The reply comes when the call is gone.
  std::get<ClientCall<v1::PauseRequest, v1::PauseReply>>(unanswered_[0]).reply(absl::OkStatus(), {});
}

TEST_F(Service, ADeadlineEndsACallAlsoWhereItIsServed) {
  // The request has to arrive before its deadline, however busy the machine is.
  for (std::chrono::milliseconds patience(50); unanswered_.empty(); patience *= 2) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + patience);
    v1::Reply reply;
    ASSERT_EQ(stub_->Do(&context, v1::Request(), &reply).error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
    unanswered_ = queue_.take();
  }
  expect_call_has_ended();
}

TEST_F(Service, ClosingEndsCallsThatNobodyAnswered) {
  auto client = std::async(std::launch::async, [&] {
    grpc::ClientContext context;
    v1::PauseReply reply;
    return stub_->Pause(&context, v1::PauseRequest(), &reply);
  });
  next();
  edge_->close();
  EXPECT_FALSE(client.get().ok());
}

TEST_F(Service, AClosedQueueIsUnavailable) {
  queue_.close();
  grpc::ClientContext context;
  v1::PauseReply reply;
  const grpc::Status status = stub_->Pause(&context, v1::PauseRequest(), &reply);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_TRUE(stands_by(status)) << "others may take what a closed queue refuses";
}

TEST_F(Service, APortInUseIsSaidSo) {
  const auto second = ClientEdge::open(edge_->address(), std::nullopt, queue_);
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr("in use"));
  EXPECT_THAT(std::string(second.status().message()), HasSubstr(edge_->address()));
}

TEST_F(Service, WhatIsNoAddressIsSaidSo) {
  for (const char* address : {"", "nonsense", "127.0.0.1:", ":7300", "127.0.0.1:70000", "127.0.0.1:-1"}) {
    EXPECT_EQ(ClientEdge::open(address, std::nullopt, queue_).status().code(),
              absl::StatusCode::kInvalidArgument)
        << address;
  }
}

TEST(RequestQueue, HasALimit) {
  RequestQueue queue([] {});
  for (std::size_t n = 0; n < kQueuedRequestsMax; ++n) {
    ClientRequest request = ClientCall<v1::StatusRequest, v1::StatusReply>{};
    ASSERT_TRUE(queue.push(request, 0).ok());
  }
  ClientRequest request = ClientCall<v1::StatusRequest, v1::StatusReply>{};
  EXPECT_EQ(queue.push(request, 0).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(queue.take().size(), kQueuedRequestsMax);
  EXPECT_TRUE(queue.push(request, 0).ok());
}

// Requests that are told apart by the bytes of a name.
ClientRequest request_named(std::size_t name) {
  ClientCall<v1::BalanceRequest, v1::BalanceReply> call;
  call.id.number = name;
  return call;
}

TEST(RequestQueue, ClientsTakeTurns) {
  RequestQueue queue([] {});
  std::size_t name = 0;
  for (const char* client : {"much", "much", "much", "little", "much", "other", "little"}) {
    ClientRequest request = request_named(name++);
    ASSERT_TRUE(queue.push(request, 1, client).ok());
  }
  std::vector<std::size_t> order;
  while (const std::optional<ClientRequest> next = queue.take_next()) {
    order.push_back(std::get<ClientCall<v1::BalanceRequest, v1::BalanceReply>>(*next).id.number);
  }
  EXPECT_THAT(order, ::testing::ElementsAre(0, 3, 5, 1, 6, 2, 4));
  EXPECT_TRUE(queue.is_empty());
}

TEST(RequestQueue, OneClientLeavesRoomForOthers) {
  RequestQueue queue([] {});
  const auto push = [&](const std::string& client) {
    ClientRequest request = request_named(0);
    return queue.push(request, 0, client);
  };
  for (std::size_t n = 0; n < kQueuedRequestsPerClientMax; ++n) ASSERT_TRUE(push("much").ok());
  const absl::Status refused = push("much");
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("1024 requests of this connection wait"));
  EXPECT_TRUE(push("little").ok());
  queue.take_next();
  EXPECT_TRUE(push("much").ok());
}

TEST(RequestQueue, HasALimitOfBytes) {
  RequestQueue queue([] {}, /*bytes_max=*/100);
  ClientRequest request = ClientCall<v1::StatusRequest, v1::StatusReply>{};
  EXPECT_TRUE(queue.push(request, 1000).ok()) << "one alone may have any size";
  request = ClientCall<v1::StatusRequest, v1::StatusReply>{};
  const absl::Status refused = queue.push(request, 1);
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("exceed 100 (--queued-mib)"));
  EXPECT_EQ(queue.room_for(1), refused);
  EXPECT_EQ(queue.take().size(), 1u);
  for (int n = 0; n < 2; ++n) {
    request = ClientCall<v1::StatusRequest, v1::StatusReply>{};
    EXPECT_TRUE(queue.push(request, 50).ok());
  }
  EXPECT_FALSE(queue.room_for(1).ok());
  queue.close();
  EXPECT_EQ(queue.room_for(0).code(), absl::StatusCode::kUnavailable);
}

// Large requests that nobody takes: the queue holds some, and the rest is told so at once.
TEST_F(Service, LargeRequestsDoNotPileUp) {
  RequestQueue queue([] {}, /*bytes_max=*/1 << 20);
  const auto edge = ClientEdge::open("127.0.0.1:0", std::nullopt, queue);
  ASSERT_TRUE(edge.ok()) << edge.status();
  const auto stub =
      v1::Tessera::NewStub(grpc::CreateChannel((*edge)->address(), grpc::InsecureChannelCredentials()));
  const v1::Request request = request_of({spawn(std::string(400 << 10, 'x'))});
  std::vector<std::future<grpc::StatusCode>> answers;
  for (int n = 0; n < 8; ++n) {
    answers.push_back(std::async(std::launch::async, [&] {
      grpc::ClientContext context;
      v1::Reply reply;
      return stub->Do(&context, request, &reply).error_code();
    }));
  }
  // Two of them wait in the queue; the others are answered.
  const auto answered = [&] {
    return std::ranges::count_if(answers, [](const auto& answer) {
      return answer.wait_for(std::chrono::milliseconds(10)) == std::future_status::ready;
    });
  };
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (answered() < 6 && std::chrono::steady_clock::now() < deadline) {
  }
  std::vector<ClientRequest> waiting = queue.take();
  EXPECT_EQ(waiting.size(), 2u);
  for (ClientRequest& one : waiting) {
    std::visit([](auto& call) { call.reply(absl::OkStatus(), {}); }, one);
  }
  std::map<grpc::StatusCode, int> codes;
  for (auto& answer : answers) ++codes[answer.get()];
  EXPECT_EQ(codes[grpc::StatusCode::OK], 2);
  EXPECT_EQ(codes[grpc::StatusCode::RESOURCE_EXHAUSTED], 6);
}

}  // namespace
}  // namespace tessera
