#include "coordinator/grpc_etcd.h"

#include <absl/strings/str_cat.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "etcd.grpc.pb.h"
#include "proto/status.h"

namespace tessera {
namespace {

using etcdserverpb::KV;
using etcdserverpb::Lease;

// An error is told after this time at the earliest, since the call is likely to be made again.
constexpr std::chrono::milliseconds kAgain{50};

struct Member {
  std::string address;
  std::unique_ptr<KV::Stub> keys;
  std::unique_ptr<Lease::Stub> leases;
};

class GrpcEtcd final : public Etcd {
 public:
  GrpcEtcd(std::vector<Member> members, std::function<void()> wake)
      : members_(std::move(members)), wake_(std::move(wake)) {}

  std::future<absl::StatusOr<etcdserverpb::TxnResponse>> transact(etcdserverpb::TxnRequest request) override {
    return start<absl::StatusOr<etcdserverpb::TxnResponse>>(
        [request = std::move(request)](
            Member& member, grpc::ClientContext& context) -> absl::StatusOr<etcdserverpb::TxnResponse> {
          etcdserverpb::TxnResponse response;
          absl::Status status = from_grpc(member.keys->Txn(&context, request, &response));
          if (!status.ok()) return status;
          return response;
        });
  }

  std::future<absl::StatusOr<std::int64_t>> grant_lease(std::chrono::seconds duration) override {
    return start<absl::StatusOr<std::int64_t>>(
        [duration](Member& member, grpc::ClientContext& context) -> absl::StatusOr<std::int64_t> {
          etcdserverpb::LeaseGrantRequest request;
          request.set_ttl(duration.count());
          etcdserverpb::LeaseGrantResponse response;
          absl::Status status = from_grpc(member.leases->LeaseGrant(&context, request, &response));
          if (!status.ok()) return status;
          return response.id();
        });
  }

  std::future<absl::StatusOr<bool>> keep_alive(std::int64_t lease) override {
    return start<absl::StatusOr<bool>>(
        [lease](Member& member, grpc::ClientContext& context) -> absl::StatusOr<bool> {
          const auto stream = member.leases->LeaseKeepAlive(&context);
          etcdserverpb::LeaseKeepAliveRequest request;
          request.set_id(lease);
          etcdserverpb::LeaseKeepAliveResponse response;
          const bool is_answered = stream->Write(request) && stream->WritesDone() && stream->Read(&response);
          const absl::Status status = from_grpc(stream->Finish());
          if (is_answered) return response.ttl() > 0;
          return status.ok() ? absl::UnavailableError("etcd did not answer for the lease") : status;
        });
  }

  std::future<absl::Status> revoke(std::int64_t lease) override {
    return start<absl::Status>([lease](Member& member, grpc::ClientContext& context) {
      etcdserverpb::LeaseRevokeRequest request;
      request.set_id(lease);
      etcdserverpb::LeaseRevokeResponse response;
      return from_grpc(member.leases->LeaseRevoke(&context, request, &response));
    });
  }

 private:
  // Calls on a thread of its own; whoever is woken finds the result there.
  template <typename Result, typename Call>
  std::future<Result> start(Call call) {
    auto promise = std::make_shared<std::promise<Result>>();
    std::future<Result> future = promise->get_future();
    const std::lock_guard lock(mutex_);
    std::erase_if(calls_, [](const std::future<void>& other) {
      return other.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    });
    calls_.push_back(std::async(std::launch::async, [this, call = std::move(call), promise] {
      promise->set_value(result_of<Result>(call));
      wake_();
    }));
    return future;
  }

  template <typename Result, typename Call>
  Result result_of(const Call& call) {
    const auto again = std::chrono::steady_clock::now() + kAgain;
    std::size_t place = place_.load();
    Member& member = members_[place % members_.size()];
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kEtcdCallMax);
    Result result = call(member, context);
    const absl::Status status = status_of(result);
    if (status.ok()) return result;
    place_.compare_exchange_strong(place, place + 1);
    std::this_thread::sleep_until(again);
    return absl::Status(status.code(), absl::StrCat("etcd at ", member.address, ": ", status.message()));
  }

  static const absl::Status& status_of(const absl::Status& status) { return status; }
  template <typename T>
  static const absl::Status& status_of(const absl::StatusOr<T>& value) {
    return value.status();
  }

  std::vector<Member> members_;
  std::function<void()> wake_;
  std::atomic<std::size_t> place_ = 0;  // of the member that is asked
  std::mutex mutex_;
  std::vector<std::future<void>> calls_;  // that have not ended, and some that have
};

}  // namespace

std::unique_ptr<Etcd> connect_etcd(const EtcdAccess& access, std::function<void()> wake) {
  const std::shared_ptr<grpc::ChannelCredentials> open = grpc::InsecureChannelCredentials();
  const std::shared_ptr<grpc::ChannelCredentials> tls =
      grpc::SslCredentials({.pem_root_certs = access.authority,
                            .pem_private_key = access.key,
                            .pem_cert_chain = access.certificate});
  std::vector<Member> members;
  for (const EtcdMember& member : access.members) {
    grpc::ChannelArguments arguments;
    arguments.SetMaxReceiveMessageSize(-1);
    arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
    arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 100);
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 500);
    const auto channel = grpc::CreateCustomChannel(member.address, member.has_tls ? tls : open, arguments);
    members.push_back({member.address, KV::NewStub(channel), Lease::NewStub(channel)});
  }
  return std::make_unique<GrpcEtcd>(std::move(members), std::move(wake));
}

}  // namespace tessera
