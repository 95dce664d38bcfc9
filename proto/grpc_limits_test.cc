#include "proto/grpc_limits.h"

#include <gmock/gmock.h>
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <string>
#include <utility>
#include <vector>

#include "proto/peak_memory.h"
#include "tessera.grpc.pb.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

constexpr std::chrono::seconds kPatience{60};  // for machines that are busy
constexpr std::size_t kUnfoldedBytes = std::size_t{256} << 20;

// Takes requests as a gateway does, without looking at them.
class Anything final : public grpc::CallbackGenericService {
 public:
  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext*) override {
    class Reader final : public grpc::ServerGenericBidiReactor {
     public:
      Reader() { StartRead(&request_); }
      void OnReadDone(bool) override { Finish({grpc::StatusCode::NOT_FOUND, "read"}); }
      void OnDone() override { delete this; }

     private:
      grpc::ByteBuffer request_;
    };
    return new Reader();
  }
};

class GrpcLimits : public ::testing::Test {
 protected:
  template <typename Register>
  void serve(const Register& services) {
    grpc::ServerBuilder builder;
    int port = 0;
    limit_clients(builder, /*threads_max=*/8);
    builder.SetMaxReceiveMessageSize(1 << 30);
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    services(builder);
    server_ = builder.BuildAndStart();
    address_ = "127.0.0.1:" + std::to_string(port);
  }
  void TearDown() override { server_->Shutdown(std::chrono::system_clock::now()); }

  // Asks for the status with a message of zeros.
  grpc::Status ask(grpc_compression_algorithm compression) const {
    grpc::GenericStub stub(grpc::CreateChannel(address_, grpc::InsecureChannelCredentials()));
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    context.set_compression_algorithm(compression);
    grpc::CompletionQueue done;
    const grpc::Slice message(zeros_.data(), zeros_.size(), grpc::Slice::STATIC_SLICE);
    const auto call = stub.PrepareUnaryCall(&context, "/tessera.v1.Tessera/GetStatus",
                                            grpc::ByteBuffer(&message, 1), &done);
    call->StartCall();
    grpc::ByteBuffer answer;
    grpc::Status status;
    call->Finish(&answer, &status, nullptr);
    void* tag = nullptr;
    bool is_ok = false;
    done.Next(&tag, &is_ok);
    return status;
  }

  void expect_compressed_requests_are_refused() const {
    const std::uint64_t before = peak_rss_bytes(getpid());
    for (const grpc_compression_algorithm compression : {GRPC_COMPRESS_DEFLATE, GRPC_COMPRESS_GZIP}) {
      const grpc::Status status = ask(compression);
      EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
      EXPECT_THAT(status.error_message(), HasSubstr("ompression algorithm"));
    }
    EXPECT_LT(peak_rss_bytes(getpid()) - before, kUnfoldedBytes / 4) << "they have been unfolded";
  }

 private:
  const std::vector<char> zeros_ = std::vector<char>(kUnfoldedBytes);
  std::unique_ptr<grpc::Server> server_;
  std::string address_;
};

TEST_F(GrpcLimits, CompressedRequestsAreRefusedBeforeTheyAreUnfolded) {
  v1::Tessera::Service tessera;
  serve([&](grpc::ServerBuilder& builder) { builder.RegisterService(&tessera); });
  expect_compressed_requests_are_refused();
}

TEST_F(GrpcLimits, GatewaysRefuseThemToo) {
  Anything anything;
  serve([&](grpc::ServerBuilder& builder) { builder.RegisterCallbackGenericService(&anything); });
  expect_compressed_requests_are_refused();
  EXPECT_EQ(ask(GRPC_COMPRESS_NONE).error_code(), grpc::StatusCode::NOT_FOUND)
      << "it is for others to answer";
}

}  // namespace
}  // namespace tessera
