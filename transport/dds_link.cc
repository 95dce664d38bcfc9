#include "transport/dds_link.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/types/span.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <string_view>
#include <thread>
#include <utility>

#include "cluster.h"
#include "dds/dds.h"
#include "transport/dds_beacon.h"
#include "transport/dds_domain.h"
#include "transport/host_lane.h"
#include "transport/peer_stream.h"

namespace tessera {
namespace {

using Clock = std::chrono::steady_clock;

// Port numbers of higher domains do not exist.
constexpr std::uint32_t kDomainMax = 232;
constexpr std::size_t kClusterNameBytesMax = 64;

// A process whose writers have been silent for this long counts as lost. DDS keeps its connections much
// longer (LeaseDuration), so a stall of a second does not require a new discovery.
constexpr dds_duration_t kSilenceMax = DDS_SECS(1);
// DDS sends a sign of life after 80 % of the shortest liveliness period of any writer. One writer without
// readers has a shorter period than the others, so a late or lost sign does no harm.
constexpr dds_duration_t kPulse = DDS_MSECS(500);

// DDS keeps samples that the DDS of the other end (not its process) has not acknowledged, and blocks a writer
// when they exceed the configured amount, which takes a stopped or unreachable process. Then we retry after
// this time, because no event tells when writing would succeed.
constexpr dds_duration_t kWriteWait = DDS_MSECS(1);
constexpr std::chrono::milliseconds kStallRetry{10};

// Processes that this one has heard of since it began; more are not listened to.
constexpr std::size_t kPeersMax = 4096;
// Rings of shared memory each way, at a time; what goes to more processes takes the network.
constexpr std::size_t kLanesMax = 256;

// Where messages come through shared memory all the time, DDS is looked at so often.
constexpr std::chrono::microseconds kLookInterval{100};

constexpr int kTakeBatch = 64;
constexpr int kTriggerBatch = 32;

constexpr dds_attach_t kWakeAttachment = 0;
constexpr dds_attach_t kReaderAttachment = 1;
constexpr dds_attach_t kSilenceAttachment = 2;
constexpr dds_attach_t kLookAttachment = 3;

// Our share of the receive buffer that the kernel grants on this host, assuming that other hosts are
// configured alike.
std::size_t choose_window() {
  std::size_t buffer_bytes = 0;
  std::ifstream("/proc/sys/net/core/rmem_max") >> buffer_bytes;
  return std::clamp(buffer_bytes / 4, kWindowBytesMin, kWindowBytesMax);
}

Session draw_session() {
  std::random_device device;
  Session session = 0;
  while (session == 0) session = (Session{device()} << 32) | device();
  return session;
}

// For calls that fail only when out of memory or because of a bug.
dds_return_t must(dds_return_t rc, const char* what) {
  if (rc < 0) {
    std::fprintf(stderr, "tessera: %s\n", dds_error(rc, what).ToString().c_str());
    std::abort();
  }
  return rc;
}

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
struct ListenerDeleter {
  void operator()(dds_listener_t* listener) const { dds_delete_listener(listener); }
};
using Qos = std::unique_ptr<dds_qos_t, QosDeleter>;

Qos inbox_qos() {
  Qos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, kWriteWait);
  dds_qset_durability(qos.get(), DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_ALL, 0);
  dds_qset_resource_limits(qos.get(), DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  return qos;
}

tessera_Message to_message(NodeId from, NodeId to, const Packet& packet) {
  tessera_Message message{};
  message.from = from.value;
  message.from_session = packet.from_session;
  message.to = to.value;
  message.to_session = packet.to_session;
  message.sequence_number = packet.sequence;
  message.acknowledged = packet.acknowledged;
  message.rest = packet.rest;
  message.control = static_cast<std::uint8_t>((packet.sync ? tessera_CONTROL_SYNC : 0) |
                                              (packet.welcome ? tessera_CONTROL_WELCOME : 0));
  // DDS only reads what it writes.
  message.payload._buffer = reinterpret_cast<std::uint8_t*>(const_cast<char*>(packet.payload.data()));
  message.payload._length = static_cast<std::uint32_t>(packet.payload.size());
  message.payload._maximum = message.payload._length;
  return message;
}

Packet to_packet(const tessera_Message& message) {
  return {.from_session = message.from_session,
          .to_session = message.to_session,
          .sequence = message.sequence_number,
          .acknowledged = message.acknowledged,
          .rest = message.rest,
          .sync = (message.control & tessera_CONTROL_SYNC) != 0,
          .welcome = (message.control & tessera_CONTROL_WELCOME) != 0,
          .payload = {reinterpret_cast<const char*>(message.payload._buffer), message.payload._length}};
}

}  // namespace

class DdsLink::Impl {
 public:
  Impl(const DdsOptions& options, DdsDomain domain)
      : options_(options), session_(draw_session()), domain_(std::move(domain)) {}
  ~Impl() {
    // After this no thread of DDS calls us; the lock makes their writes visible.
    if (participant_ > 0) dds_delete(participant_);
    const std::lock_guard lock(silent_mutex_);
    silent_ = {};
  }

  absl::Status open();
  void send(NodeId to, std::string payload);
  std::vector<Delivery> receive(Clock::time_point deadline, Clock::duration eager);
  void wake() { dds_set_guardcondition(wake_, true); }
  std::vector<NodeId> take_lost() { return std::exchange(lost_, {}); }
  void forget(NodeId peer);
  const DdsOptions& options() const { return options_; }
  BeaconOptions beacon() const {
    return {.cluster = options_.cluster, .node = options_.self, .session = session_, .endpoint = {}};
  }
  dds_entity_t participant() const { return participant_; }

 private:
  // Travels with each writer, so that the owner of the inbox knows who connects to it.
  struct Sender {
    NodeId node;
    Session session = 0;
    LaneOffer lane;
  };

  struct Peer {
    Peer(NodeId node, Session self, std::size_t window_bytes) : stream(node, self, window_bytes) {}
    PeerStream stream;
    dds_entity_t topic = 0;
    dds_entity_t writer = 0;
    // DDS did not accept the next packet: try again later.
    bool stalled = false;
    // Shared memory to the peer and from it, where it runs on this host.
    std::unique_ptr<LaneWriter> to;
    std::unique_ptr<LaneReader> from;
    Session from_session = 0;
    bool must_wake = false;  // it sleeps, and there is something in `to`

    std::optional<Packet> next() const {
      std::optional<Packet> packet = stream.next();
      if (!packet && must_wake) packet = stream.acknowledgement();
      return packet;
    }
    bool has_ready() { return from && stream.session() == from_session && from->ready(stream.received()); }
  };

  Peer& peer(NodeId node);
  dds_entity_t create_inbox_topic(NodeId node);
  absl::Status create_pulse();
  void on_reader_event(std::vector<Delivery>& deliveries);
  void on_writer_event(Peer& peer);
  void note_senders(std::vector<Delivery>& deliveries);
  bool write_lane(Peer& peer, std::string_view payload);
  void open_lane(const Sender& sender);
  void close_lane_of(const Sender& sender, std::vector<Delivery>& deliveries);
  void read_lane(Peer& peer, std::vector<Delivery>& deliveries);
  void read_lanes(std::vector<Delivery>& deliveries);
  bool any_lane_ready();
  std::optional<Sender> sender_of(dds_instance_handle_t writer) const;
  // Runs on a thread of DDS.
  static void on_liveliness_changed(dds_entity_t reader, dds_liveliness_changed_status_t status, void* self);
  void take_silent();
  void take(std::vector<Delivery>& deliveries);
  void pump(Peer& peer);
  // Waits for events, and handles them. True if it was woken.
  bool wait(Clock::time_point deadline, std::vector<Delivery>& deliveries);

  DdsOptions options_;
  Session session_;
  std::size_t window_bytes_ = choose_window();
  DdsDomain domain_;
  dds_entity_t participant_ = 0;
  dds_entity_t reader_ = 0;
  dds_entity_t waitset_ = 0;
  dds_entity_t wake_ = 0;
  dds_entity_t silence_ = 0;
  // Set while receive() only looks. To wait for a moment that has passed would still send the thread to
  // sleep, and a timer would wake it: 15 us.
  dds_entity_t look_ = 0;
  std::map<NodeId, std::unique_ptr<Peer>> peers_;
  std::vector<Peer*> lanes_from_;  // peers with a ring to here
  // The writers that DDS has connected to our inbox, and their processes.
  std::map<dds_instance_handle_t, Sender> senders_;
  // Set by the threads of DDS: the writers that have fallen silent.
  std::mutex silent_mutex_;
  std::vector<dds_instance_handle_t> silent_;
  // Peers with events since they were last pumped; may contain duplicates.
  std::vector<Peer*> touched_;
  std::vector<NodeId> lost_;
  Clock::time_point next_look_;  // at DDS
};

absl::Status DdsLink::Impl::open() {
  participant_ = dds_create_participant(options_.domain, nullptr, nullptr);
  if (participant_ < 0) return dds_error(participant_, "cannot join the DDS domain");
  const dds_entity_t topic = create_inbox_topic(options_.self);
  if (topic < 0) return dds_error(topic, "cannot create the topic of the inbox");
  silence_ = dds_create_guardcondition(participant_);
  if (silence_ < 0) return dds_error(silence_, "cannot create a guard condition");
  const std::unique_ptr<dds_listener_t, ListenerDeleter> listener(dds_create_listener(this));
  dds_lset_liveliness_changed(listener.get(), &Impl::on_liveliness_changed);
  reader_ = dds_create_reader(participant_, topic, inbox_qos().get(), listener.get());
  if (reader_ < 0) return dds_error(reader_, "cannot create the inbox");
  waitset_ = dds_create_waitset(participant_);
  if (waitset_ < 0) return dds_error(waitset_, "cannot create a waitset");
  wake_ = dds_create_guardcondition(participant_);
  if (wake_ < 0) return dds_error(wake_, "cannot create a guard condition");
  look_ = dds_create_guardcondition(participant_);
  if (look_ < 0) return dds_error(look_, "cannot create a guard condition");
  must(dds_set_status_mask(reader_, DDS_DATA_AVAILABLE_STATUS | DDS_SUBSCRIPTION_MATCHED_STATUS), "inbox");
  must(dds_waitset_attach(waitset_, reader_, kReaderAttachment), "cannot wait for the inbox");
  must(dds_waitset_attach(waitset_, wake_, kWakeAttachment), "cannot wait for a wake-up");
  must(dds_waitset_attach(waitset_, silence_, kSilenceAttachment), "cannot wait for silence");
  must(dds_waitset_attach(waitset_, look_, kLookAttachment), "cannot look at the inbox");
  return create_pulse();
}

absl::Status DdsLink::Impl::create_pulse() {
  const std::string name = topic_name(options_.cluster, "pulse");
  const dds_entity_t topic =
      dds_create_topic(participant_, &tessera_Beacon_desc, name.c_str(), nullptr, nullptr);
  if (topic < 0) return dds_error(topic, "cannot create the topic of the pulse");
  const Qos qos(dds_create_qos());
  dds_qset_liveliness(qos.get(), DDS_LIVELINESS_AUTOMATIC, kPulse);
  const dds_entity_t writer = dds_create_writer(participant_, topic, qos.get(), nullptr);
  return writer < 0 ? dds_error(writer, "cannot create the pulse") : absl::OkStatus();
}

dds_entity_t DdsLink::Impl::create_inbox_topic(NodeId node) {
  const std::string name = topic_name(options_.cluster, absl::StrFormat("inbox/%016x", node.value));
  return dds_create_topic(participant_, &tessera_Message_desc, name.c_str(), nullptr, nullptr);
}

DdsLink::Impl::Peer& DdsLink::Impl::peer(NodeId node) {
  std::unique_ptr<Peer>& slot = peers_[node];
  if (slot == nullptr) {
    slot = std::make_unique<Peer>(node, session_, window_bytes_);
    slot->topic = must(create_inbox_topic(node), "cannot create the topic of a peer");
    const Qos qos = inbox_qos();
    dds_qset_liveliness(qos.get(), DDS_LIVELINESS_AUTOMATIC, kSilenceMax);
    const auto lanes = std::count_if(peers_.begin(), peers_.end(),
                                     [](const auto& entry) { return entry.second && entry.second->to; });
    if (options_.network.shared_memory && static_cast<std::size_t>(lanes) < kLanesMax)
      slot->to = LaneWriter::create();
    const Sender sender{options_.self, session_, slot->to ? slot->to->offer() : LaneOffer{}};
    dds_qset_userdata(qos.get(), &sender, sizeof sender);
    slot->writer =
        must(dds_create_writer(participant_, slot->topic, qos.get(), nullptr), "cannot write to a peer");
    must(dds_set_status_mask(slot->writer, DDS_PUBLICATION_MATCHED_STATUS), "writer");
    must(dds_waitset_attach(waitset_, slot->writer, reinterpret_cast<dds_attach_t>(slot.get())),
         "cannot wait for a peer");
  }
  return *slot;
}

void DdsLink::Impl::send(NodeId to, std::string payload) {
  Peer& receiver = peer(to);
  if (write_lane(receiver, payload)) return;
  receiver.stream.push(std::move(payload));
  pump(receiver);
}

void DdsLink::Impl::forget(NodeId node) {
  const auto found = peers_.find(node);
  if (found == peers_.end()) return;
  Peer& peer = *found->second;
  peer.stream.forget();
  peer.to.reset();
  peer.from.reset();
  std::erase(lanes_from_, &peer);
}

bool DdsLink::Impl::write_lane(Peer& peer, std::string_view payload) {
  if (!peer.to || !peer.stream.is_open() || !peer.to->serves(peer.stream.session())) return false;
  if (!peer.to->write(peer.stream.pushed(), payload)) return false;
  if (peer.to->take_asleep()) {
    peer.must_wake = true;
    pump(peer);
  }
  return true;
}

void DdsLink::Impl::open_lane(const Sender& sender) {
  if (!options_.network.shared_memory || sender.lane.process == 0 || lanes_from_.size() >= kLanesMax) return;
  std::unique_ptr<LaneReader> lane = LaneReader::open(sender.lane, session_);
  if (!lane) return;
  Peer& from = peer(sender.node);
  if (!from.from) lanes_from_.push_back(&from);
  from.from = std::move(lane);
  from.from_session = sender.session;
}

// A ring stays open while its writer may write, also where DDS has lost sight of it.
void DdsLink::Impl::close_lane_of(const Sender& sender, std::vector<Delivery>& deliveries) {
  const auto found = peers_.find(sender.node);
  if (found == peers_.end()) return;
  Peer& peer = *found->second;
  if (!peer.from || !(peer.from->offer() == sender.lane) || peer.from->has_writer()) return;
  read_lane(peer, deliveries);
  peer.from.reset();
  std::erase(lanes_from_, &peer);
}

void DdsLink::Impl::read_lane(Peer& peer, std::vector<Delivery>& deliveries) {
  while (peer.has_ready()) {
    peer.stream.heard_elsewhere();
    deliveries.push_back({peer.stream.peer(), *peer.from->read(peer.stream.received())});
  }
}

void DdsLink::Impl::read_lanes(std::vector<Delivery>& deliveries) {
  for (Peer* const peer : lanes_from_) read_lane(*peer, deliveries);
}

bool DdsLink::Impl::any_lane_ready() {
  return std::any_of(lanes_from_.begin(), lanes_from_.end(), [](Peer* peer) { return peer->has_ready(); });
}

void DdsLink::Impl::pump(Peer& peer) {
  peer.stalled = false;
  while (const std::optional<Packet> packet = peer.next()) {
    const tessera_Message message = to_message(options_.self, peer.stream.peer(), *packet);
    const dds_return_t rc = dds_write(peer.writer, &message);
    if (rc == DDS_RETCODE_TIMEOUT) {
      peer.stalled = true;
      return;
    }
    must(rc, "cannot send");
    peer.stream.sent(*packet);
    peer.must_wake = false;
  }
}

std::vector<Delivery> DdsLink::Impl::receive(Clock::time_point deadline, Clock::duration eager) {
  std::vector<Delivery> deliveries;
  if (eager > Clock::duration::zero() && !lanes_from_.empty()) {
    const Clock::time_point eager_until = std::min(deadline, Clock::now() + eager);
    while (!any_lane_ready() && Clock::now() < eager_until) std::this_thread::yield();
  }
  read_lanes(deliveries);
  if (!deliveries.empty()) {
    if (Clock::now() < next_look_) return deliveries;
    deadline = {};
  }
  for (;;) {
    const bool stalled =
        std::any_of(peers_.begin(), peers_.end(), [](const auto& entry) { return entry.second->stalled; });
    const bool woken = wait(stalled ? std::min(deadline, Clock::now() + kStallRetry) : deadline, deliveries);
    next_look_ = Clock::now() + kLookInterval;
    read_lanes(deliveries);
    if (stalled) {
      for (const auto& [node, peer] : peers_) {
        if (peer->stalled) touched_.push_back(peer.get());
      }
    }
    for (Peer* touched : std::exchange(touched_, {})) {
      if (touched->stream.take_loss()) lost_.push_back(touched->stream.peer());
      pump(*touched);
    }
    if (woken || !deliveries.empty() || !lost_.empty() || Clock::now() >= deadline) return deliveries;
  }
}

bool DdsLink::Impl::wait(Clock::time_point deadline, std::vector<Delivery>& deliveries) {
  // Bounded, so that an infinite deadline does not overflow.
  const auto left = std::min<Clock::duration>(deadline - Clock::now(), std::chrono::hours(1));
  const dds_time_t until = dds_time() + std::chrono::duration_cast<std::chrono::nanoseconds>(left).count();
  std::array<dds_attach_t, kTriggerBatch> triggered;
  for (Peer* const peer : lanes_from_) peer->from->sleep();
  const bool only_looks = left <= Clock::duration::zero() || any_lane_ready();
  if (only_looks) must(dds_set_guardcondition(look_, true), "cannot look at the inbox");
  const dds_return_t count =
      must(dds_waitset_wait_until(waitset_, triggered.data(), triggered.size(), until), "cannot wait");
  if (only_looks) {
    bool was_set = false;
    must(dds_take_guardcondition(look_, &was_set), "cannot look at the inbox");
  }
  for (Peer* const peer : lanes_from_) peer->from->stop_sleeping();
  bool woken = false;
  bool silence = false;
  // If more were triggered than there was room for, the next call gets the rest.
  const auto events = absl::MakeSpan(triggered).first(std::min<std::size_t>(count, triggered.size()));
  for (const dds_attach_t event : events) {
    bool was_set = false;
    if (event == kWakeAttachment) {
      dds_take_guardcondition(wake_, &was_set);
      woken = true;
    } else if (event == kReaderAttachment) {
      on_reader_event(deliveries);
    } else if (event == kSilenceAttachment) {
      dds_take_guardcondition(silence_, &was_set);
      silence = true;
    }
  }
  // After the inbox, so that the last messages of a peer that has gone are received first.
  for (const dds_attach_t event : events) {
    if (event > kLookAttachment) on_writer_event(*reinterpret_cast<Peer*>(event));
  }
  if (silence) take_silent();
  return woken;
}

void DdsLink::Impl::on_liveliness_changed(dds_entity_t, dds_liveliness_changed_status_t status, void* self) {
  if (status.not_alive_count_change <= 0) return;
  Impl& impl = *static_cast<Impl*>(self);
  {
    const std::lock_guard lock(impl.silent_mutex_);
    impl.silent_.push_back(status.last_publication_handle);
  }
  dds_set_guardcondition(impl.silence_, true);
}

void DdsLink::Impl::take_silent() {
  std::vector<dds_instance_handle_t> silent;
  {
    const std::lock_guard lock(silent_mutex_);
    silent.swap(silent_);
  }
  for (const dds_instance_handle_t handle : silent) {
    const auto sender = senders_.find(handle);
    if (sender == senders_.end()) continue;
    const auto known = peers_.find(sender->second.node);
    if (known == peers_.end()) continue;
    known->second->stream.fell_silent(sender->second.session);
    touched_.push_back(known->second.get());
  }
}

void DdsLink::Impl::on_writer_event(Peer& peer) {
  dds_publication_matched_status_t status;
  must(dds_get_publication_matched_status(peer.writer, &status), "cannot query the matched readers");
  if (status.total_count_change > 0) peer.stream.connected();
  if (status.current_count == 0) {
    peer.stream.disconnected();
    peer.to.reset();
  }
  touched_.push_back(&peer);
}

void DdsLink::Impl::on_reader_event(std::vector<Delivery>& deliveries) {
  dds_subscription_matched_status_t status;
  must(dds_get_subscription_matched_status(reader_, &status), "cannot query the matched writers");
  if (status.total_count_change != 0 || status.current_count_change != 0) note_senders(deliveries);
  take(deliveries);
}

void DdsLink::Impl::note_senders(std::vector<Delivery>& deliveries) {
  std::vector<dds_instance_handle_t> handles(64);
  for (;;) {
    const dds_return_t count = must(dds_get_matched_publications(reader_, handles.data(), handles.size()),
                                    "cannot query the matched writers");
    const bool complete = static_cast<std::size_t>(count) <= handles.size();
    handles.resize(count);
    if (complete) break;
  }
  std::map<dds_instance_handle_t, Sender> now;
  for (const dds_instance_handle_t handle : handles) {
    if (const auto known = senders_.find(handle); known != senders_.end()) {
      now.insert(*known);
      continue;
    }
    const std::optional<Sender> sender = sender_of(handle);
    if (!sender) continue;
    now.emplace(handle, *sender);
    open_lane(*sender);
    if (const auto known = peers_.find(sender->node); known != peers_.end()) {
      known->second->stream.heard_of();
      touched_.push_back(known->second.get());
    }
  }
  for (const auto& [handle, sender] : senders_) {
    if (!now.contains(handle)) close_lane_of(sender, deliveries);
  }
  senders_ = std::move(now);
}

std::optional<DdsLink::Impl::Sender> DdsLink::Impl::sender_of(dds_instance_handle_t writer) const {
  dds_builtintopic_endpoint_t* endpoint = dds_get_matched_publication_data(reader_, writer);
  // It may have disappeared again.
  if (endpoint == nullptr) return std::nullopt;
  void* data = nullptr;
  std::size_t size = 0;
  std::optional<Sender> sender;
  if (dds_qget_userdata(endpoint->qos, &data, &size) && size == sizeof(Sender)) {
    std::memcpy(&sender.emplace(), data, size);
  }
  dds_free(data);
  dds_builtintopic_free_endpoint(endpoint);
  return sender;
}

void DdsLink::Impl::take(std::vector<Delivery>& deliveries) {
  dds_return_t count = kTakeBatch;
  while (count == kTakeBatch) {
    void* samples[kTakeBatch] = {nullptr};
    dds_sample_info_t infos[kTakeBatch];
    count = must(dds_take(reader_, samples, infos, kTakeBatch, kTakeBatch), "cannot read the inbox");
    for (dds_return_t i = 0; i < count; ++i) {
      if (!infos[i].valid_data) continue;
      const auto& message = *static_cast<const tessera_Message*>(samples[i]);
      if (!peers_.contains(NodeId{message.from}) && peers_.size() >= kPeersMax) continue;
      Peer& sender = peer(NodeId{message.from});
      // What was written before this packet was sent.
      read_lane(sender, deliveries);
      sender.stream.accept(to_packet(message), deliveries);
      if (touched_.empty() || touched_.back() != &sender) touched_.push_back(&sender);
    }
    if (count > 0) must(dds_return_loan(reader_, samples, count), "cannot return samples");
  }
}

DdsLink::DdsLink(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
DdsLink::~DdsLink() = default;

absl::StatusOr<std::unique_ptr<DdsLink>> DdsLink::create(const DdsOptions& options) {
  if (options.domain > kDomainMax) {
    return absl::InvalidArgumentError(absl::StrCat("DDS domain ", options.domain, " is above ", kDomainMax));
  }
  if (options.cluster.empty() || options.cluster.size() > kClusterNameBytesMax) {
    return absl::InvalidArgumentError(absl::StrCat("a cluster name has 1 to ", kClusterNameBytesMax,
                                                   " bytes, not ", options.cluster.size()));
  }
  absl::StatusOr<DdsDomain> domain = DdsDomain::open(options.domain, options.network);
  if (!domain.ok()) return domain.status();
  auto impl = std::make_unique<Impl>(options, *std::move(domain));
  if (absl::Status status = impl->open(); !status.ok()) return status;
  return std::unique_ptr<DdsLink>(new DdsLink(std::move(impl)));
}

NodeId DdsLink::self() const { return impl_->options().self; }
void DdsLink::send(NodeId to, std::string payload) { impl_->send(to, std::move(payload)); }
std::vector<Delivery> DdsLink::receive(Clock::time_point deadline) { return impl_->receive(deadline, {}); }
std::vector<Delivery> DdsLink::receive(Clock::time_point deadline, Clock::duration eager) {
  return impl_->receive(deadline, eager);
}
void DdsLink::wake() { impl_->wake(); }
std::vector<NodeId> DdsLink::take_lost_peers() { return impl_->take_lost(); }
void DdsLink::forget(NodeId peer) { impl_->forget(peer); }

absl::Status DdsLink::announce_coordinator(const std::string& endpoint, std::chrono::milliseconds discovery) {
  BeaconOptions beacon = impl_->beacon();
  beacon.endpoint = endpoint;
  beacon.discovery = discovery;
  return announce_beacon(impl_->participant(), beacon);
}

}  // namespace tessera
