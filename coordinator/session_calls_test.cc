// Streams of requests over real gRPC on loopback, with a hand in the place of the state machine.
#include "coordinator/session_calls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <deque>
#include <filesystem>
#include <future>
#include <semaphore>
#include <thread>

#include "coordinator/client_edge.h"
#include "coordinator/limits.h"
#include "coordinator/test_requests.h"
#include "coordinator/unanswered.h"
#include "keys/keys_folder.h"
#include "keys/make_keys.h"
#include "keys/test_keys.h"
#include "proto/session_header.h"
#include "proto/status.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

constexpr std::chrono::seconds kLongest{60};  // for machines that are busy

using RequestCall = ClientCall<v1::Request, v1::Reply>;

v1::Request numbered(std::uint64_t number, v1::Request request = {}) {
  request.set_number(number);
  return request;
}

class SessionCalls : public ::testing::Test {
 protected:
  void SetUp() override { open(std::nullopt); }

  void open(const std::optional<ServerKeys>& keys) {
    edge_.reset();
    auto opened = ClientEdge::open("127.0.0.1:0", keys, queue_);
    ASSERT_TRUE(opened.ok()) << opened.status();
    edge_ = *std::move(opened);
  }

  // The next request of any client.
  RequestCall next() {
    while (taken_.empty()) {
      for (ClientRequest& request : queue_.take())
        taken_.push_back(std::get<RequestCall>(std::move(request)));
      if (taken_.empty()) pushed_.acquire();
    }
    RequestCall call = std::move(taken_.front());
    taken_.pop_front();
    return call;
  }
  std::size_t waiting() {
    for (ClientRequest& request : queue_.take()) taken_.push_back(std::get<RequestCall>(std::move(request)));
    return taken_.size();
  }

  std::counting_semaphore<> pushed_{0};
  RequestQueue queue_{[this] { pushed_.release(); }};
  std::unique_ptr<ClientEdge> edge_;
  std::deque<RequestCall> taken_;
};

// A stream of a client.
class ClientStream {
 public:
  ClientStream(const std::shared_ptr<grpc::Channel>& channel, const std::string& session)
      : stub_(v1::Tessera::NewStub(channel)) {
    context_.set_deadline(std::chrono::system_clock::now() + kLongest);
    if (!session.empty()) context_.AddMetadata(kSessionHeader, session);
    stream_ = stub_->Session(&context_);
  }
  ClientStream(const ClientEdge& edge, const std::string& session)
      : ClientStream(grpc::CreateChannel(edge.address(), grpc::InsecureChannelCredentials()), session) {}

  ~ClientStream() {
    if (is_finished_) return;
    context_.TryCancel();
    stream_->Finish();
  }
  ClientStream(const ClientStream&) = delete;
  ClientStream& operator=(const ClientStream&) = delete;

  void send(const v1::Request& request) { EXPECT_TRUE(stream_->Write(request)); }
  v1::Reply read() {
    v1::Reply reply;
    EXPECT_TRUE(stream_->Read(&reply));
    return reply;
  }
  // What comes until the stream ends, and how.
  std::vector<v1::Reply> rest() {
    std::vector<v1::Reply> replies;
    for (v1::Reply reply; stream_->Read(&reply);) replies.push_back(reply);
    return replies;
  }
  grpc::Status finish() {
    is_finished_ = true;
    return stream_->Finish();
  }
  void done() { stream_->WritesDone(); }
  void cancel() { context_.TryCancel(); }

 private:
  std::unique_ptr<v1::Tessera::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::Request, v1::Reply>> stream_;
  bool is_finished_ = false;
};

v1::Reply completed(Tick tick) {
  v1::Reply reply;
  reply.set_tick(tick);
  return reply;
}

// Without waiting for the replies, which come as they are known.
TEST_F(SessionCalls, CarryManyRequestsAtATime) {
  ClientStream stream(*edge_, "18446744073709551615");
  for (std::uint64_t number = 1; number <= 3; ++number)
    stream.send(numbered(number, request_of({push("ball")})));
  std::vector<RequestCall> calls;
  for (std::uint64_t number = 1; number <= 3; ++number) {
    calls.push_back(next());
    EXPECT_EQ(calls.back().id.session, ~std::uint64_t{0});
    EXPECT_EQ(calls.back().id.number, number) << "in the order in which they were sent";
    EXPECT_EQ(calls.back().request.commands_size(), 1);
  }
  for (const std::size_t n : {2, 0, 1}) {
    calls[n].reply(absl::OkStatus(), completed(10 + n));
    const v1::Reply reply = stream.read();
    EXPECT_EQ(reply.number(), n + 1);
    EXPECT_EQ(reply.tick(), 10 + n);
    EXPECT_EQ(reply.code(), 0u);
  }
  stream.done();
  EXPECT_TRUE(stream.rest().empty());
  EXPECT_TRUE(stream.finish().ok());
}

TEST_F(SessionCalls, GoOnAfterAnError) {
  ClientStream stream(*edge_, "7");
  stream.send(numbered(1));
  next().reply(absl::NotFoundError("no such body"), {});
  const v1::Reply refused = stream.read();
  EXPECT_EQ(refused.number(), 1u);
  EXPECT_EQ(refused.code(), static_cast<std::uint32_t>(absl::StatusCode::kNotFound));
  EXPECT_EQ(refused.message(), "no such body");
  stream.send(numbered(2));
  next().reply(absl::UnavailableError("a server was lost"), {});
  EXPECT_EQ(stream.read().code(), static_cast<std::uint32_t>(absl::StatusCode::kUnavailable));
  stream.send(numbered(3));
  next().reply(absl::OkStatus(), completed(5));
  EXPECT_EQ(stream.read().tick(), 5u);
}

TEST_F(SessionCalls, EndOnceTheClientHasAllReplies) {
  ClientStream stream(*edge_, "7");
  stream.send(numbered(1));
  stream.send(numbered(2));
  stream.done();
  RequestCall first = next();
  RequestCall second = next();
  second.reply(absl::OkStatus(), {});
  EXPECT_EQ(stream.read().number(), 2u);
  first.reply(absl::OkStatus(), {});
  const std::vector<v1::Reply> rest = stream.rest();
  ASSERT_EQ(rest.size(), 1u);
  EXPECT_EQ(rest[0].number(), 1u);
  EXPECT_TRUE(stream.finish().ok());
}

// The client makes what it has no reply to again, wherever another coordinator leads.
TEST_F(SessionCalls, EndWhereAnotherCoordinatorLeads) {
  ClientStream stream(*edge_, "7");
  stream.send(numbered(1));
  next().reply(unanswered_error("this coordinator does not lead any more"), {});
  EXPECT_TRUE(stream.rest().empty());
  const grpc::Status status = stream.finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_FALSE(stands_by(status)) << "it may have been carried out";
}

TEST_F(SessionCalls, EndWhereACoordinatorStandsBy) {
  queue_.close();
  ClientStream stream(*edge_, "7");
  stream.send(numbered(1));
  EXPECT_TRUE(stream.rest().empty());
  EXPECT_TRUE(stands_by(stream.finish()));
}

TEST_F(SessionCalls, WithoutAHeaderBelongToNoSession) {
  for (const std::string header : {"", "seven", "-1", "18446744073709551616"}) {
    ClientStream stream(*edge_, header);
    stream.send(numbered(1));
    RequestCall call = next();
    EXPECT_EQ(call.id.session, 0u) << header;
    call.reply(absl::OkStatus(), {});
    EXPECT_EQ(stream.read().number(), 1u);
  }
}

TEST_F(SessionCalls, OfAClientThatVanishesLeaveNothingBehind) {
  std::vector<RequestCall> calls;
  {
    ClientStream stream(*edge_, "7");
    stream.send(numbered(1));
    stream.send(numbered(2));
    calls.push_back(next());
    calls.push_back(next());
    stream.cancel();
    EXPECT_TRUE(stream.rest().empty());
    EXPECT_EQ(stream.finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  // Closing waits for every call that is still under way.
  std::future<void> closed = std::async(std::launch::async, [&] { edge_->close(); });
  EXPECT_EQ(closed.wait_for(kLongest), std::future_status::ready) << "the call is still open";
  for (RequestCall& call : calls) call.reply(absl::OkStatus(), {});  // when the stream is gone
}

TEST_F(SessionCalls, ClosingEndsThem) {
  ClientStream stream(*edge_, "7");
  stream.send(numbered(1));
  next();
  edge_->close();
  EXPECT_TRUE(stream.rest().empty());
  EXPECT_FALSE(stream.finish().ok());
}

// One that does not wait for its replies is read from no faster than they come.
TEST_F(SessionCalls, HaveSoManyRequestsUnderWay) {
  ClientStream stream(*edge_, "7");
  std::thread client([&] {
    for (std::uint64_t number = 1; number <= kStreamRequestsMax + 1; ++number) stream.send(numbered(number));
  });
  std::deque<RequestCall> calls;
  while (calls.size() < kStreamRequestsMax) calls.push_back(next());
  client.join();
  EXPECT_EQ(waiting(), 0u);
  calls.front().reply(absl::OkStatus(), {});
  EXPECT_EQ(next().id.number, kStreamRequestsMax + 1);
  EXPECT_EQ(stream.read().number(), 1u);
}

// The queue holds so much; the rest is told so, and the stream goes on.
TEST_F(SessionCalls, OfAQueueThatIsFullAreToldSo) {
  RequestQueue queue([] {}, /*bytes_max=*/1 << 20);
  const auto edge = ClientEdge::open("127.0.0.1:0", std::nullopt, queue);
  ASSERT_TRUE(edge.ok()) << edge.status();
  ClientStream stream(**edge, "7");
  const std::string name(400 << 10, 'x');
  for (const std::uint64_t number : {1, 2, 3}) stream.send(numbered(number, request_of({spawn(name)})));
  const v1::Reply refused = stream.read();
  EXPECT_EQ(refused.number(), 3u);
  EXPECT_EQ(refused.code(), static_cast<std::uint32_t>(absl::StatusCode::kResourceExhausted));
  for (ClientRequest& request : queue.take()) std::get<RequestCall>(request).reply(absl::OkStatus(), {});
  EXPECT_EQ(stream.read().number(), 1u);
  EXPECT_EQ(stream.read().number(), 2u);
}

// Whose role is to command what it owns has its name in each request, whatever it says.
TEST_F(SessionCalls, HaveTheNameOfWhoCommandsItsOwn) {
  const TestKeys keys;
  ASSERT_TRUE(add_client(keys.folder(), "alice", ClientRole::kOwn, 30).ok());
  open(read_server_keys(keys.folder(), kDaemonFolder).value());
  const auto ask = [&](bool is_alice) {
    const std::filesystem::path folder = keys.folder() / (is_alice ? "alice" : "control");
    const auto channel = ClientKeys::read(folder).value().channel(edge_->address(), {});
    v1::Request disguised = request_of({push("ball")});
    disguised.set_owner("bob");
    ClientStream stream(channel, "7");
    stream.send(numbered(1, disguised));
    RequestCall call = next();
    call.reply(absl::OkStatus(), {});
    EXPECT_EQ(stream.read().code(), 0u);
    const auto stub = v1::Tessera::NewStub(channel);
    auto done = std::async(std::launch::async, [&stub, disguised] {
      grpc::ClientContext context;
      v1::Reply reply;
      return stub->Do(&context, disguised, &reply).error_code();
    });
    RequestCall alone = next();
    EXPECT_EQ(alone.request.owner(), call.request.owner());
    alone.reply(absl::OkStatus(), {});
    EXPECT_EQ(done.get(), grpc::StatusCode::OK);
    if (is_alice) {
      stream.send(numbered(2, request_of({}, 3)));
      EXPECT_THAT(stream.read().message(), HasSubstr("the role own may not change a world"));
    }
    return call.request.owner();
  };
  EXPECT_EQ(ask(true), "alice");
  EXPECT_EQ(ask(false), "bob") << "it may speak for others";
  std::filesystem::remove(keys.folder() / "alice" / kKeyFile);
  std::filesystem::remove(keys.folder() / "alice" / kCertificateFile);
  EXPECT_EQ(ask(true), "alice") << "by its token";
}

// Who only observes may ask, and change nothing: by a certificate, and by a token.
TEST_F(SessionCalls, ChangeNothingForWhoOnlyObserves) {
  const TestKeys keys;
  open(read_server_keys(keys.folder(), kDaemonFolder).value());
  constexpr auto kDenied = absl::StatusCode::kPermissionDenied;
  const auto expect_roles_are_kept = [&] {
    for (const std::string role : {"observe", "control"}) {
      SCOPED_TRACE(role);
      const bool may_change = role == "control";
      const auto channel = ClientKeys::read(keys.folder() / role).value().channel(edge_->address(), {});
      ClientStream stream(channel, "7");
      std::uint64_t number = 0;
      for (const v1::Request& change : {request_of({push("ball")}), request_of({}, 3)}) {
        stream.send(numbered(++number, change));
        if (may_change) next().reply(absl::OkStatus(), {});
        const v1::Reply reply = stream.read();
        EXPECT_EQ(reply.number(), number);
        EXPECT_EQ(reply.code(), static_cast<std::uint32_t>(may_change ? absl::StatusCode::kOk : kDenied));
        EXPECT_EQ(reply.message(),
                  may_change ? "" : "the role observe may not change a world: it needs control");
      }
      stream.send(numbered(++number, request_of({}, 0, {hash_query()})));
      next().reply(absl::OkStatus(), completed(4));
      EXPECT_EQ(stream.read().tick(), 4u);

      const auto stub = v1::Tessera::NewStub(channel);
      const auto do_alone = [&](const v1::Request& request) {
        return std::async(std::launch::async, [&stub, request] {
          grpc::ClientContext context;
          v1::Reply reply;
          return stub->Do(&context, request, &reply).error_code();
        });
      };
      auto change = do_alone(request_of({push("ball")}));
      if (may_change) next().reply(absl::OkStatus(), {});
      EXPECT_EQ(change.get(), may_change ? grpc::StatusCode::OK : grpc::StatusCode::PERMISSION_DENIED);
      auto query = do_alone(request_of({}, 0, {hash_query()}));
      next().reply(absl::OkStatus(), {});
      EXPECT_EQ(query.get(), grpc::StatusCode::OK);
    }
  };
  expect_roles_are_kept();
  for (const char* role : {"observe", "control"}) {
    std::filesystem::remove(keys.folder() / role / kKeyFile);
    std::filesystem::remove(keys.folder() / role / kCertificateFile);
  }
  expect_roles_are_kept();
}

}  // namespace
}  // namespace tessera
