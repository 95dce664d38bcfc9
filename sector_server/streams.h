// Streams to clients: states of bodies, contact events and clones and islands at seams of this server's
// partition, over gRPC.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "cluster.pb.h"
#include "lpss/tick/tick_machine.h"
#include "tessera.grpc.pb.h"
#include "transport/link.h"

namespace tessera {

// The bodies that a client watches, at the end of a tick. They are serialised on the thread that sends them,
// so ticks do not wait for it.
struct BodySnapshot {
  struct Body {
    BodyId id;
    SectorIndex home;
    BodyState state;
    Pose centre_frame;  // in the body frame
  };

  Tick tick = 0;
  v1::StreamSource source;
  double sector_size = 0;
  std::vector<Body> bodies;  // each once, in any order
};

// A queue of batches for one client. The tick fills it, a gRPC thread empties it.
template <typename Request, typename Batch>
class Subscription {
 public:
  static constexpr std::size_t kBatchesMax = 4096;  // a client that is further behind is disconnected
  static constexpr std::size_t kSpareMax = 2;

  explicit Subscription(Request request) : request_(std::move(request)) {}

  const Request& request() const { return request_; }

  void push(Batch batch) {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    if (batches_.size() >= kBatchesMax) {
      overrun_ = closed_ = true;
    } else {
      batches_.push_back(std::move(batch));
    }
    changed_.notify_one();
  }
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_one();
  }
  bool overrun() const {
    const std::lock_guard lock(mutex_);
    return overrun_;
  }

  // The next batch; nothing once the subscription is closed, or `patience` has passed (then alive() tells).
  std::optional<Batch> next(std::chrono::milliseconds patience) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, patience, [&] { return closed_ || !batches_.empty(); });
    if (batches_.empty()) return std::nullopt;
    Batch batch = std::move(batches_.front());
    batches_.pop_front();
    return batch;
  }
  // Returns a batch of next() that is no longer needed; its memory is reused.
  void take_back(Batch batch) {
    const std::lock_guard lock(mutex_);
    if (spare_.size() < kSpareMax) spare_.push_back(std::move(batch));
  }
  // Such a batch, with its old contents, or else an empty one.
  Batch spare() {
    const std::lock_guard lock(mutex_);
    if (spare_.empty()) return {};
    Batch batch = std::move(spare_.back());
    spare_.pop_back();
    return batch;
  }
  bool alive() const {
    const std::lock_guard lock(mutex_);
    return !closed_ || !batches_.empty();
  }

  // Owned by the list that holds it.
  bool served = false;  // the initial state has been sent, in this world
  // Since when it waits for the client that has it at other servers.
  std::optional<std::chrono::steady_clock::time_point> unclaimed_since;

 private:
  const Request request_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Batch> batches_;
  std::vector<Batch> spare_;
  bool closed_ = false;
  bool overrun_ = false;
};

class Streams final : public v1::Streams::Service {
 public:
  // `wake` is called when a client subscribes, so that it is also shown a paused world.
  Streams(NodeId node, std::function<void()> wake) : node_(node), wake_(std::move(wake)) {}

  // The following are for the thread that owns the partition.

  // The world that publish() is about from now on. Streams go on where it is one that was set back, and those
  // that clients have at other servers begin.
  void begin_world(const v1::LoadWorld& load);

  // After every tick, and with `new_only` while the world is paused.
  void publish(Tick tick, TickMachine& machine, bool new_only);

  // Those that clients expect to find at all servers of the world; nothing if that has not changed since the
  // last call.
  std::optional<v1::Subscriptions> changed_subscriptions();

  // Ends all streams.
  void shut_down();

  grpc::Status WatchBodies(grpc::ServerContext* context, const v1::WatchBodiesRequest* request,
                           grpc::ServerWriter<v1::BodyBatch>* writer) override;
  grpc::Status WatchContacts(grpc::ServerContext* context, const v1::WatchContactsRequest* request,
                             grpc::ServerWriter<v1::ContactBatch>* writer) override;
  grpc::Status WatchSeams(grpc::ServerContext* context, const v1::WatchSeamsRequest* request,
                          grpc::ServerWriter<v1::SeamBatch>* writer) override;
  grpc::Status WatchDivergences(grpc::ServerContext* context, const v1::WatchDivergencesRequest* request,
                                grpc::ServerWriter<v1::DivergenceBatch>* writer) override;

 private:
  using Bodies = Subscription<v1::WatchBodiesRequest, BodySnapshot>;
  using Contacts = Subscription<v1::WatchContactsRequest, v1::ContactBatch>;
  using Seams = Subscription<v1::WatchSeamsRequest, v1::SeamBatch>;

  using Divergences = Subscription<v1::WatchDivergencesRequest, v1::DivergenceBatch>;
  template <typename S>
  using List = std::list<std::shared_ptr<S>>;

  template <typename Batch>
  Batch batch_of(Tick tick, bool is_first = false) const;
  template <typename S, typename Request>
  static void expect(List<S>& list, const Request& request);
  template <typename S, typename Request>
  std::shared_ptr<S> claim(List<S>& list, const Request& request);
  template <typename Visit>
  void for_each_list(const Visit& visit);
  void drop_unclaimed();

  v1::DivergenceBatch divergences_in(Tick tick, const std::vector<Divergence>& divergences) const;
  v1::SeamBatch seams_for(const v1::WatchSeamsRequest& request, Tick tick, const Partition& partition) const;
  v1::ContactBatch contacts_for(const v1::WatchContactsRequest& request, Tick tick,
                                const std::vector<ContactEvent>& events) const;

  // `send` writes one batch of the subscription, and returns whether the client still accepts batches.
  template <typename S, typename Request, typename Send>
  grpc::Status serve(List<S>& list, grpc::ServerContext* context, const Request& request, const Send& send);

  const NodeId node_;
  const std::function<void()> wake_;
  v1::StreamSource source_;  // of the world; owned by the thread that publishes
  std::mutex mutex_;         // guards the following
  List<Bodies> bodies_;
  List<Contacts> contacts_;
  List<Seams> seams_;
  List<Divergences> divergences_;
  bool changed_ = false;  // the lists, since changed_subscriptions()
  bool closing_ = false;
};

}  // namespace tessera
