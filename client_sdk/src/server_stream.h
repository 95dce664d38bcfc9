// One gRPC stream to each server of a cluster, merged.
#pragma once

#include <absl/strings/str_cat.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client_sdk/src/stream_merger.h"
#include "proto/status.h"
#include "tessera.grpc.pb.h"
#include "tessera/stream.h"

namespace tessera {

// `Traits` defines the frame, its batch on the wire, the request and the decoding.
template <typename Traits>
class ServerStreams final : public Stream<typename Traits::Frame> {
 public:
  using Frame = typename Traits::Frame;

  ServerStreams(const std::vector<std::string>& addresses, const typename Traits::Request& request)
      : merger_(addresses.size()) {
    for (std::size_t source = 0; source < addresses.size(); ++source) {
      auto reader = std::make_unique<Reader>();
      grpc::ChannelArguments arguments;
      arguments.SetMaxReceiveMessageSize(-1);
      reader->stub = v1::Streams::NewStub(
          grpc::CreateCustomChannel(addresses[source], grpc::InsecureChannelCredentials(), arguments));
      reader->thread = std::thread([this, source, address = addresses[source], request, from = reader.get()] {
        read(source, address, request, *from);
      });
      readers_.push_back(std::move(reader));
    }
  }

  ~ServerStreams() override {
    cancel();
    for (const auto& reader : readers_) reader->thread.join();
  }

  absl::Status wait_for_all(absl::Duration timeout) { return merger_.wait_for_all(timeout); }
  absl::StatusOr<Frame> next(absl::Duration timeout) override { return merger_.next(timeout); }
  std::uint64_t skipped() const override { return merger_.skipped(); }

  void cancel() override {
    merger_.end(absl::CancelledError("the stream was cancelled"));
    for (const auto& reader : readers_) reader->context.TryCancel();
  }

 private:
  struct Reader {
    grpc::ClientContext context;
    std::unique_ptr<v1::Streams::Stub> stub;
    std::thread thread;
  };

  void read(std::size_t source, const std::string& address, const typename Traits::Request& request,
            Reader& reader) {
    const auto stream = Traits::open(*reader.stub, &reader.context, request);
    typename Traits::Batch batch;
    bool first = true;
    while (stream->Read(&batch)) {
      absl::StatusOr<Frame> frame = Traits::read(batch);
      if (!frame.ok()) {
        merger_.end(
            absl::DataLossError(absl::StrCat("sector server at ", address, ": ", frame.status().message())));
        break;
      }
      if (!merger_.push(source, *std::move(frame), !first || Traits::kFirstIsWhole)) break;
      first = false;
    }
    reader.context.TryCancel();
    const grpc::Status status = stream->Finish();
    const absl::Status why = from_grpc(status);
    const std::string said = why.ok() ? "it ended the stream" : std::string(why.message());
    const absl::StatusCode code =
        why.code() == absl::StatusCode::kResourceExhausted ? why.code() : absl::StatusCode::kUnavailable;
    merger_.end(absl::Status(code, absl::StrCat("sector server at ", address, ": ", said)));
  }

  StreamMerger<Frame> merger_;
  std::vector<std::unique_ptr<Reader>> readers_;
};

}  // namespace tessera
