// Calls through a gateway in this process, to daemons that only answer.
#include <absl/strings/str_cat.h>
#include <absl/synchronization/notification.h>
#include <absl/time/time.h>
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "gateway/gateway_service.h"
#include "proto/server_header.h"
#include "proto/session_header.h"
#include "proto/status.h"
#include "tessera.grpc.pb.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

constexpr std::chrono::seconds kPatience{60};
constexpr std::chrono::milliseconds kWaitMax{2000};  // for a coordinator
constexpr std::uint64_t kNode = 7;

std::string header(const grpc::ServerContext& context, const char* name) {
  const auto found = context.client_metadata().find(name);
  return found == context.client_metadata().end() ? ""
                                                  : std::string(found->second.data(), found->second.size());
}

class Server {
 public:
  explicit Server(grpc::Service& service) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(&service);
    server_ = builder.BuildAndStart();
  }
  ~Server() { server_->Shutdown(std::chrono::system_clock::now()); }

  std::string address() const { return absl::StrCat("127.0.0.1:", port_); }

 private:
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

// Leads or stands by; replies to requests, and counts what reaches it.
class Coordinator final : public v1::Tessera::Service {
 public:
  explicit Coordinator(bool leads) : leads_(leads), server_(std::make_unique<Server>(*this)) {}
  ~Coordinator() override { server_.reset(); }

  grpc::Status GetStatus(grpc::ServerContext*, const v1::StatusRequest*, v1::StatusReply* reply) override {
    if (!leads_) return to_grpc(stands_by_error("another one leads"));
    reply->set_state("paused");
    v1::ServerStatus& server = *reply->add_servers();
    server.set_node(kNode);
    server.set_stream_address(streams_);
    return grpc::Status::OK;
  }
  grpc::Status Pause(grpc::ServerContext* context, const v1::PauseRequest*, v1::PauseReply* reply) override {
    if (!leads_) return to_grpc(stands_by_error("another one leads"));
    ++calls_;
    token_ = header(*context, "authorization");
    context->AddTrailingMetadata("x-trailer", "kept");
    reply->set_tick(11);
    return grpc::Status::OK;
  }
  grpc::Status Unload(grpc::ServerContext*, const v1::UnloadRequest*, v1::UnloadReply*) override {
    return {grpc::StatusCode::FAILED_PRECONDITION, "no world is loaded", "details"};
  }
  grpc::Status Session(grpc::ServerContext* context,
                       grpc::ServerReaderWriter<v1::Reply, v1::Request>* stream) override {
    if (!leads_) {
      v1::Request request;
      stream->Read(&request);
      if (!refused_.HasBeenNotified()) refused_.Notify();
      return to_grpc(stands_by_error("another one leads"));
    }
    session_ = header(*context, kSessionHeader);
    for (v1::Request request; stream->Read(&request);) {
      v1::Reply reply;
      reply.set_number(request.number());
      stream->Write(reply);
    }
    return grpc::Status::OK;
  }

  std::string address() const { return server_->address(); }
  void set_leads(bool leads) { leads_ = leads; }
  void set_streams(std::string address) { streams_ = std::move(address); }
  int calls() const { return calls_; }
  bool await_refused_session() {
    return refused_.WaitForNotificationWithTimeout(absl::FromChrono(kPatience));
  }
  const std::string& token() const { return token_; }
  const std::string& session() const { return session_; }

 private:
  std::atomic<bool> leads_;
  std::atomic<int> calls_ = 0;
  absl::Notification refused_;
  std::string streams_;
  std::string token_;
  std::string session_;
  std::unique_ptr<Server> server_;
};

// Sends batches until the client has enough, or has gone.
class SectorServer final : public v1::Streams::Service {
 public:
  SectorServer() : server_(std::make_unique<Server>(*this)) {}
  ~SectorServer() override { server_.reset(); }

  grpc::Status WatchBodies(grpc::ServerContext* context, const v1::WatchBodiesRequest* request,
                           grpc::ServerWriter<v1::BodyBatch>* writer) override {
    v1::BodyBatch batch;
    batch.set_node(kNode);
    for (std::uint64_t tick = 0; request->every_ticks() == 0 || tick < request->every_ticks(); ++tick) {
      batch.set_tick(tick);
      if (!writer->Write(batch)) break;
    }
    const std::lock_guard lock(mutex_);
    was_cancelled_ = context->IsCancelled();
    has_ended_ = true;
    ended_.notify_all();
    return grpc::Status::OK;
  }

  std::string address() const { return server_->address(); }
  bool await_cancelled() {
    std::unique_lock lock(mutex_);
    return ended_.wait_for(lock, kPatience, [this] { return has_ended_; }) && was_cancelled_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable ended_;
  bool has_ended_ = false;
  bool was_cancelled_ = false;
  std::unique_ptr<Server> server_;
};

class Gateway {
 public:
  explicit Gateway(const std::vector<std::string>& coordinators, const GatewayLimits& limits = {100, 100},
                   bool wants_tokens = false)
      : traffic_(limits),
        routes_(
            coordinators, ClientKeys(), [](const auto&) {}, kWaitMax),
        service_(routes_, traffic_, wants_tokens) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterCallbackGenericService(&service_);
    server_ = builder.BuildAndStart();
    const auto channel =
        grpc::CreateChannel(absl::StrCat("127.0.0.1:", port_), grpc::InsecureChannelCredentials());
    calls_ = v1::Tessera::NewStub(channel);
    streams_ = v1::Streams::NewStub(channel);
  }
  ~Gateway() {
    server_->Shutdown(std::chrono::system_clock::now());
    server_->Wait();
  }

  v1::Tessera::Stub& calls() { return *calls_; }
  v1::Streams::Stub& streams() { return *streams_; }
  const Traffic& traffic() const { return traffic_; }

 private:
  Traffic traffic_;
  Routes routes_;
  GatewayService service_;
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<v1::Tessera::Stub> calls_;
  std::unique_ptr<v1::Streams::Stub> streams_;
};

struct Context : grpc::ClientContext {
  Context() { set_deadline(std::chrono::system_clock::now() + kPatience); }
};

TEST(GatewayTest, PassesOnCallsWithHeadersAndStatus) {
  Coordinator coordinator(true);
  Gateway gateway({coordinator.address()});
  Context context;
  context.AddMetadata("authorization", "Bearer abc");
  v1::PauseReply reply;
  ASSERT_TRUE(gateway.calls().Pause(&context, {}, &reply).ok());
  EXPECT_EQ(reply.tick(), 11u);
  EXPECT_EQ(coordinator.token(), "Bearer abc");
  EXPECT_EQ(context.GetServerTrailingMetadata().count("x-trailer"), 1u);
  Context other;
  v1::UnloadReply nothing;
  const grpc::Status status = gateway.calls().Unload(&other, {}, &nothing);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(status.error_message(), "no world is loaded");
  EXPECT_EQ(status.error_details(), "details");
}

TEST(GatewayTest, SaysThatTheStatusCameThroughIt) {
  Coordinator coordinator(true);
  coordinator.set_streams("127.0.0.1:1");
  Gateway gateway({coordinator.address()});
  Context context;
  v1::StatusReply status;
  ASSERT_TRUE(gateway.calls().GetStatus(&context, {}, &status).ok());
  EXPECT_TRUE(status.through_gateway());
  EXPECT_EQ(status.state(), "paused");
  EXPECT_EQ(status.servers_size(), 1);
}

TEST(GatewayTest, StreamsOfRequestsKeepTheirOrder) {
  constexpr std::uint64_t kRequests = 2000;
  Coordinator coordinator(true);
  Gateway gateway({coordinator.address()});
  Context context;
  context.AddMetadata(kSessionHeader, "42");
  const auto stream = gateway.calls().Session(&context);
  std::thread writer([&] {
    v1::Request request;
    for (std::uint64_t number = 1; number <= kRequests; ++number) {
      request.set_number(number);
      stream->Write(request);
    }
    stream->WritesDone();
  });
  std::uint64_t next = 1;
  for (v1::Reply reply; stream->Read(&reply); ++next) EXPECT_EQ(reply.number(), next);
  writer.join();
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(next, kRequests + 1);
  EXPECT_EQ(coordinator.session(), "42");
}

TEST(GatewayTest, FindsTheCoordinatorThatLeadsAlsoWhereThatChanges) {
  Coordinator first(true);
  Coordinator second(false);
  Gateway gateway({first.address(), second.address()});
  const auto pause = [&] {
    Context context;
    v1::PauseReply reply;
    return gateway.calls().Pause(&context, {}, &reply);
  };
  EXPECT_TRUE(pause().ok());
  second.set_leads(true);
  first.set_leads(false);
  EXPECT_TRUE(pause().ok());
  EXPECT_EQ(first.calls(), 1);
  EXPECT_EQ(second.calls(), 1);
}

TEST(GatewayTest, AnEndThatComesWhileTheCallIsMadeAgainLosesNoRequest) {
  Coordinator first(true);
  Coordinator second(false);
  Gateway gateway({first.address(), second.address()});
  {
    Context context;
    v1::StatusReply status;
    ASSERT_TRUE(gateway.calls().GetStatus(&context, {}, &status).ok());
  }
  first.set_leads(false);
  Context context;
  const auto stream = gateway.calls().Session(&context);
  v1::Request request;
  request.set_number(1);
  stream->Write(request);
  ASSERT_TRUE(first.await_refused_session());
  stream->WritesDone();
  second.set_leads(true);
  v1::Reply reply;
  ASSERT_TRUE(stream->Read(&reply));
  EXPECT_EQ(reply.number(), 1);
  EXPECT_FALSE(stream->Read(&reply));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST(GatewayTest, WithoutACoordinatorNothingIsDone) {
  Coordinator coordinator(false);
  Gateway gateway({coordinator.address()});
  Context context;
  v1::PauseReply reply;
  const grpc::Status status = gateway.calls().Pause(&context, {}, &reply);
  EXPECT_TRUE(stands_by(status));
  EXPECT_THAT(status.error_message(), HasSubstr(coordinator.address()));
}

TEST(GatewayTest, OpensStreamsAtTheServerThatIsNamed) {
  constexpr int kBatches = 1000;
  SectorServer server;
  Coordinator coordinator(true);
  coordinator.set_streams(server.address());
  Gateway gateway({coordinator.address()});
  Context context;
  context.AddMetadata(kServerHeader, absl::StrCat(kNode));
  v1::WatchBodiesRequest request;
  request.set_every_ticks(kBatches);
  const auto stream = gateway.streams().WatchBodies(&context, request);
  std::uint64_t next = 0;
  for (v1::BodyBatch batch; stream->Read(&batch); ++next) EXPECT_EQ(batch.tick(), next);
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(next, kBatches);
  EXPECT_EQ(gateway.traffic().of(Traffic::kStreams).replies, kBatches);
}

TEST(GatewayTest, AClientThatGoesEndsItsStreamAtTheServer) {
  SectorServer server;
  Coordinator coordinator(true);
  coordinator.set_streams(server.address());
  Gateway gateway({coordinator.address()});
  Context context;
  context.AddMetadata(kServerHeader, absl::StrCat(kNode));
  const auto stream = gateway.streams().WatchBodies(&context, {});  // without an end
  v1::BodyBatch batch;
  EXPECT_TRUE(stream->Read(&batch));
  context.TryCancel();
  EXPECT_TRUE(server.await_cancelled());
}

TEST(GatewayTest, SaysWhatIsWrongWithAStream) {
  Coordinator coordinator(true);
  coordinator.set_streams("127.0.0.1:1");
  Gateway gateway({coordinator.address()});
  const auto watch = [&](const std::string& node) {
    Context context;
    if (!node.empty()) context.AddMetadata(kServerHeader, node);
    const auto stream = gateway.streams().WatchBodies(&context, {});
    v1::BodyBatch batch;
    EXPECT_FALSE(stream->Read(&batch));
    return stream->Finish();
  };
  EXPECT_EQ(watch("").error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(watch("seven").error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(watch("8").error_message(), HasSubstr("no sector server 8"));
  EXPECT_EQ(watch("8").error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST(GatewayTest, CallsBeyondTheLimitAreRefused) {
  SectorServer server;
  Coordinator coordinator(true);
  coordinator.set_streams(server.address());
  Gateway gateway({coordinator.address()}, {.calls = 100, .calls_per_client = 1});
  Context context;
  context.AddMetadata(kServerHeader, absl::StrCat(kNode));
  const auto stream = gateway.streams().WatchBodies(&context, {});
  v1::BodyBatch batch;
  ASSERT_TRUE(stream->Read(&batch));
  Context other;
  v1::PauseReply reply;
  EXPECT_EQ(gateway.calls().Pause(&other, {}, &reply).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(gateway.traffic().refused(), 1u);
  EXPECT_EQ(gateway.traffic().under_way(), 1u);
  context.TryCancel();
}

TEST(GatewayTest, WithKeysACallNeedsAToken) {
  Coordinator coordinator(true);
  Gateway gateway({coordinator.address()}, {100, 100}, /*wants_tokens=*/true);
  Context context;
  v1::PauseReply reply;
  EXPECT_EQ(gateway.calls().Pause(&context, {}, &reply).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(coordinator.calls(), 0);
}

}  // namespace
}  // namespace tessera
