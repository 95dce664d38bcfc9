// Streams to clients: states of bodies, contact events and clones and islands at seams of this server's
// partition, over gRPC.
#pragma once

#include <cstddef>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "cluster.pb.h"
#include "lpss/observe/body_changes.h"
#include "lpss/observe/program_changes.h"
#include "lpss/tick/tick_machine.h"
#include "sector_server/body_snapshot.h"
#include "sector_server/sector_server.h"
#include "sector_server/stream_budget.h"
#include "sector_server/subscription.h"
#include "sector_server/told_bodies.h"
#include "sector_server/watched_programs.h"
#include "tessera.grpc.pb.h"
#include "transport/link.h"

namespace tessera {

class Streams final : public v1::Streams::Service {
 public:
  // `wake` is called when a client subscribes, so that it is also shown a paused world.
  Streams(NodeId node, std::function<void()> wake) : node_(node), wake_(std::move(wake)) {}

  // The following are for the thread that owns the partition.

  // The world that publish() is about from now on. Streams go on where it is one that was set back, and those
  // that clients have at other servers begin. A guest hosts nothing of it: streams from when it did so end,
  // and begin as those of a new server do once it takes part.
  void begin_world(const v1::LoadWorld& load);

  // The world has other servers from a tick on, or its sectors are on others of them; where this one is new
  // among them, streams that clients have at the others begin. Streams that were told of the tick before are
  // told of it again, if that was all: some servers did so before the change, and some do after it.
  void change_servers(const NewServers& servers);

  // The world goes on without this server: all streams end once clients have what there is for them.
  void end_world();

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
  grpc::Status WatchPrograms(grpc::ServerContext* context, const v1::WatchProgramsRequest* request,
                             grpc::ServerWriter<v1::ProgramBatch>* writer) override;

 private:
  struct Bodies : Subscription<v1::WatchBodiesRequest, BodySnapshot> {
    explicit Bodies(const v1::WatchBodiesRequest& request)
        : Subscription(request), told(request), budget(request.bytes_per_second(), Time::clock::now()) {}

    // What it has told: it is told again.
    void forget() { told.forget(); }

    ToldBodies told;  // of the thread that publishes
    StreamBudget budget;
  };
  using Contacts = Subscription<v1::WatchContactsRequest, v1::ContactBatch>;
  using Seams = Subscription<v1::WatchSeamsRequest, v1::SeamBatch>;

  using Divergences = Subscription<v1::WatchDivergencesRequest, v1::DivergenceBatch>;
  struct Programs : Subscription<v1::WatchProgramsRequest, v1::ProgramBatch> {
    explicit Programs(const v1::WatchProgramsRequest& request) : Subscription(request), watched(request) {}

    void forget() { told_until = 0; }

    const WatchedPrograms watched;
    std::uint64_t told_until = 0;  // a look of program_changes_; of the thread that publishes
  };
  template <typename S>
  using List = std::list<std::shared_ptr<S>>;

  template <typename Batch>
  Batch batch_of(Tick tick, bool is_first = false) const;
  void expect(const v1::Subscription& subscription);
  template <typename S, typename Request>
  static void expect(List<S>& list, const Request& request);
  template <typename S, typename Request>
  absl::StatusOr<std::shared_ptr<S>> claim(List<S>& list, const Request& request,
                                           std::function<void()> cancel);
  template <typename Visit>
  void for_each_list(const Visit& visit);
  void drop_unclaimed();
  void close_all();
  void keep_limits();
  template <typename S>
  static bool is_wanted(const S& subscription, Tick tick, bool new_only);
  void publish_bodies(Tick tick, Partition& partition, bool new_only);
  void publish_bodies(Tick tick, const Partition& partition, Bodies& subscription);
  void publish_programs(Tick tick, const Partition& partition, bool new_only);

  v1::DivergenceBatch divergences_in(Tick tick, const std::vector<Divergence>& divergences) const;
  v1::SeamBatch seams_for(const v1::WatchSeamsRequest& request, Tick tick, const Partition& partition) const;
  v1::ContactBatch contacts_for(const v1::WatchContactsRequest& request, Tick tick,
                                const TickMachine& machine) const;

  // `send` writes one batch of a subscription, and returns whether the client still accepts batches.
  template <typename S, typename Request, typename Send>
  grpc::Status serve(List<S>& list, grpc::ServerContext* context, const Request& request, const Send& send);

  const NodeId node_;
  const std::function<void()> wake_;
  v1::StreamSource source_;         // of the world; owned by the thread that publishes
  BodyChanges body_changes_;        // likewise
  ProgramChanges program_changes_;  // likewise
  std::mutex mutex_;                // guards the following
  List<Bodies> bodies_;
  List<Contacts> contacts_;
  List<Seams> seams_;
  List<Divergences> divergences_;
  List<Programs> programs_;
  bool changed_ = false;  // the lists, since changed_subscriptions()
  bool closing_ = false;
};

}  // namespace tessera
