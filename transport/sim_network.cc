#include "transport/sim_network.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <queue>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "transport/peer_stream.h"

namespace tessera {
namespace {

enum class Kind {
  kPacket,      // arrives
  kMessage,     // arrives in the inbox
  kTimer,       // expires
  kSilence,     // `to` misses `from`
  kBreak,       // the connection breaks, for it has been useless for too long
  kConnection,  // `to` sees its connection to `from`
  kSender,      // `to` sees that `from` has a connection to it
  kResume,      // `to` goes on
};

// `order` sorts events of the same moment: first set, first run.
struct Pending {
  std::uint64_t time_ns = 0;
  std::uint64_t order = 0;
  Kind kind = Kind::kPacket;
  NodeId from;
  NodeId to;
  // The incarnations of `from` and `to` that this belongs to: a restarted node does not inherit it.
  std::uint64_t from_life = 0;
  std::uint64_t to_life = 0;
  std::uint64_t mark = 0;  // the connection, or the outage that is the reason
  Packet packet;           // with `payload` as its payload
  std::string payload;
};

struct Later {
  bool operator()(const Pending& a, const Pending& b) const {
    return std::pair(a.time_ns, a.order) > std::pair(b.time_ns, b.order);
  }
};

struct Node {
  // Counts the kills: a node that has not started yet is already in its first incarnation.
  std::uint64_t life = 0;
  bool running = false;
  std::vector<Delivery> inbox;
  std::map<NodeId, PeerStream> streams;
  std::uint64_t resumes_ns = 0;  // stands still until then
  bool is_stopped = false;       // and does not answer
  std::uint64_t outage = 0;      // the last one, from 1
  std::vector<Pending> waiting;  // until it goes on
};

// Between two nodes, in both directions.
struct Connection {
  std::uint64_t number = 0;  // each one that is made has another
  bool stands = false;
};

// From one node to another.
struct Way {
  bool is_cut = false;
  std::uint64_t outage = 0;   // the last cut
  std::vector<Pending> held;  // packets, while it is cut
};

using Pair = std::pair<NodeId, NodeId>;

Pair unordered(NodeId a, NodeId b) { return std::minmax(a, b); }

Session session_of(NodeId node, std::uint64_t life) { return (node.value << 20) + life + 1; }

[[noreturn]] void broken(const char* what, NodeId node) {
  std::fprintf(stderr, "simulated network: %s (node %llu)\n", what,
               static_cast<unsigned long long>(node.value));
  std::abort();
}

}  // namespace

class SimNetwork::State {
 public:
  State(std::uint64_t seed, SimOptions options) : engine_(seed), options_(options) {}

  std::uint64_t start(NodeId id) {
    Node& node = nodes_[id];
    if (node.running) broken("started twice", id);
    node.running = true;
    for (auto& [other, peer] : nodes_) {
      if (other != id && peer.running) make_connection(id, other);
    }
    return node.life;
  }

  void kill(NodeId id) {
    Node& node = nodes_[id];
    const std::uint64_t life = node.life++;
    node.running = false;
    node.inbox.clear();
    node.streams.clear();
    node.waiting.clear();
    node.resumes_ns = 0;
    node.is_stopped = false;
    std::erase_if(losses_, [id](const Pair& loss) { return loss.first == id; });
    last_words_[{id, life}] = now_ns_ + draw_below(options_.delay_ns_max + 1);
    const std::uint64_t outage = ++last_outage_;
    for (auto& [other, witness] : nodes_) {
      if (other == id || !witness.running) continue;
      connections_[unordered(id, other)].stands = false;
      miss(id, life, other, outage);
    }
  }

  void kill_life(NodeId id, std::uint64_t life) {
    if (lives(id, life)) kill(id);
  }

  void send(NodeId from, std::uint64_t from_life, NodeId to, std::string payload) {
    if (!lives(from, from_life)) return;
    stream(from, to).push(std::move(payload));
    pump(from, to);
  }

  void forget(NodeId id, NodeId peer) {
    const auto known = nodes_[id].streams.find(peer);
    if (known != nodes_[id].streams.end()) known->second.forget();
  }

  std::vector<Delivery> take_inbox(NodeId id, std::uint64_t life) {
    if (!lives(id, life)) return {};
    return std::exchange(nodes_[id].inbox, {});
  }

  void set_timer(NodeId id, std::uint64_t time_ns) {
    push(Kind::kTimer, id, id, std::max(time_ns, now_ns_) - now_ns_);
  }

  void cut(NodeId from, NodeId to) {
    Way& way = ways_[{from, to}];
    if (std::exchange(way.is_cut, true)) return;
    way.outage = ++last_outage_;
    miss(from, nodes_[from].life, to, way.outage);
  }

  void heal(NodeId a, NodeId b) {
    if (!is_cut(a, b)) return;
    for (const Pair& pair : {Pair(a, b), Pair(b, a)}) {
      Way& way = ways_[pair];
      way.is_cut = false;
      for (Pending& packet : std::exchange(way.held, {})) set_out(std::move(packet));
    }
    if (!connections_[unordered(a, b)].stands && nodes_[a].running && nodes_[b].running)
      make_connection(a, b);
  }

  // An end may notice only that there is another connection.
  void break_connection(NodeId a, NodeId b) {
    Connection& connection = connections_[unordered(a, b)];
    if (!connection.stands || is_cut(a, b)) return;
    connection.stands = false;
    for (const auto& [node, peer] : {Pair(a, b), Pair(b, a)}) {
      if (draw_below(2) == 0) notice_break(node, peer);
    }
    make_connection(a, b);
  }

  void hold(NodeId id, std::uint64_t until_ns, bool is_stopped) {
    Node& node = nodes_[id];
    if (!node.running || until_ns <= node.resumes_ns) return;
    node.resumes_ns = until_ns;
    push(Kind::kResume, id, id, until_ns - now_ns_);
    if (!is_stopped) return;
    node.is_stopped = true;
    node.outage = ++last_outage_;
    for (auto& [other, witness] : nodes_) {
      if (other != id && witness.running) miss(id, node.life, other, node.outage);
    }
  }

  std::optional<SimEvent> step() {
    const std::uint64_t before_ns = now_ns_;
    for (;;) {
      if (!losses_.empty()) {
        const auto [id, peer] = losses_.front();
        losses_.erase(losses_.begin());
        return SimEvent{now_ns_, id, SimEvent::Kind::kLoss, peer};
      }
      if (queue_.empty()) {
        now_ns_ = before_ns;  // nobody saw what there was
        return std::nullopt;
      }
      // The queue exposes its top as const only; it is popped immediately, so moving out of it is safe.
      Pending next = std::move(const_cast<Pending&>(queue_.top()));
      queue_.pop();
      if (!lives(next.to, next.to_life)) continue;
      Node& node = nodes_[next.to];
      if (next.kind == Kind::kResume) {
        if (next.time_ns < node.resumes_ns) continue;  // it was stopped again
        now_ns_ = next.time_ns;
        resume(next.to);
        continue;
      }
      if (node.resumes_ns > next.time_ns) {
        node.waiting.push_back(std::move(next));
        continue;
      }
      now_ns_ = next.time_ns;
      if (const std::optional<SimEvent> event = process(next)) return event;
    }
  }

  std::uint64_t now_ns() const { return now_ns_; }
  const SimCounts& counts() const { return counts_; }

 private:
  bool lives(NodeId id, std::uint64_t life) const {
    const auto node = nodes_.find(id);
    return node != nodes_.end() && node->second.life == life;
  }

  // The bias of the remainder, below 2^-40 for any sensible range, does not matter here.
  std::uint64_t draw_below(std::uint64_t count) { return engine_() % count; }
  std::uint64_t spread() const { return options_.delay_ns_max - options_.delay_ns_min + 1; }

  Pending& fill(Pending& event, Kind kind, NodeId from, NodeId to) {
    event.kind = kind;
    event.from = from;
    event.to = to;
    event.from_life = nodes_[from].life;
    event.to_life = nodes_[to].life;
    return event;
  }

  void put(Pending event, std::uint64_t delay_ns) {
    event.time_ns = now_ns_ + delay_ns;
    event.order = next_order_++;
    queue_.push(std::move(event));
  }

  void push(Kind kind, NodeId from, NodeId to, std::uint64_t delay_ns, std::uint64_t mark = 0) {
    Pending event;
    fill(event, kind, from, to).mark = mark;
    put(std::move(event), delay_ns);
  }

  // From now on, `witness` does not hear of incarnation `life` of `lost`.
  void miss(NodeId lost, std::uint64_t life, NodeId witness, std::uint64_t outage) {
    if (options_.lease_ns == 0) return;
    Pending silence;
    fill(silence, Kind::kSilence, lost, witness).mark = outage;
    silence.from_life = life;
    Pending end = silence;
    end.kind = Kind::kBreak;
    put(std::move(silence), options_.lease_ns);
    put(std::move(end), options_.connection_ns);
  }

  // Whether what miss() was told of still lasts.
  bool lasts(const Pending& miss) const {
    const Node& lost = nodes_.at(miss.from);
    if (lost.life != miss.from_life) return true;  // it is dead
    if (lost.is_stopped && lost.outage == miss.mark) return true;
    const auto way = ways_.find({miss.from, miss.to});
    return way != ways_.end() && way->second.is_cut && way->second.outage == miss.mark;
  }

  bool is_way_cut(NodeId from, NodeId to) const {
    const auto way = ways_.find({from, to});
    return way != ways_.end() && way->second.is_cut;
  }
  bool is_cut(NodeId a, NodeId b) const { return is_way_cut(a, b) || is_way_cut(b, a); }

  PeerStream& stream(NodeId id, NodeId peer) {
    Node& node = nodes_[id];
    const auto known = node.streams.find(peer);
    if (known != node.streams.end()) return known->second;
    const auto connection = connections_.find(unordered(id, peer));
    if (connection != connections_.end() && connection->second.stands) {
      push(Kind::kConnection, peer, id, options_.delay_ns_min, connection->second.number);
    }
    return node.streams.emplace(peer, PeerStream(peer, session_of(id, node.life))).first->second;
  }

  void make_connection(NodeId a, NodeId b) {
    Connection& connection = connections_[unordered(a, b)];
    if (is_cut(a, b)) return;  // when it is healed
    connection.stands = true;
    connection.number = ++last_connection_;
    for (const auto& [from, to] : {Pair(a, b), Pair(b, a)}) {
      for (const Kind kind : {Kind::kConnection, Kind::kSender}) {
        push(kind, from, to, draw_below(spread()), connection.number);
      }
    }
  }

  void notice_break(NodeId id, NodeId peer) {
    const auto known = nodes_[id].streams.find(peer);
    if (known == nodes_[id].streams.end()) return;
    known->second.disconnected();
    take_loss(id, peer, known->second);
  }

  void take_loss(NodeId id, NodeId peer, PeerStream& stream) {
    if (stream.take_loss()) losses_.emplace_back(id, peer);
  }

  // Packets of one pair keep their order.
  void set_out(Pending packet) {
    const std::uint64_t delay_ns = options_.delay_ns_min + (options_.reorder ? 0 : draw_below(spread()));
    std::uint64_t& newest = newest_ns_[{packet.from, packet.to}];
    newest = std::max(newest, now_ns_ + delay_ns);
    put(std::move(packet), newest - now_ns_);
  }

  void pump(NodeId from, NodeId to) {
    PeerStream& stream = nodes_[from].streams.at(to);
    while (const std::optional<Packet> packet = stream.next()) {
      ++counts_.sent;
      const Connection& connection = connections_[unordered(from, to)];
      if (connection.stands || is_way_cut(from, to)) {
        Pending event;
        fill(event, Kind::kPacket, from, to).mark = connection.number;
        event.packet = *packet;
        event.payload = packet->payload;
        set_out(std::move(event));
      } else {
        ++counts_.lost;  // whom it is for has gone, unnoticed
      }
      stream.sent(*packet);
    }
  }

  void resume(NodeId id) {
    Node& node = nodes_[id];
    if (std::exchange(node.is_stopped, false)) {
      for (const auto& [other, peer] : nodes_) {
        if (other != id && peer.running && !connections_[unordered(id, other)].stands) {
          make_connection(id, other);
        }
      }
      // It has not heard of the others either, and may look at that first.
      for (auto& [peer, stream] : node.streams) {
        if (options_.lease_ns == 0 || draw_below(2) == 0) continue;
        stream.fell_silent(session_of(peer, nodes_[peer].life));
        take_loss(id, peer, stream);
      }
    }
    for (Pending& event : std::exchange(node.waiting, {})) put(std::move(event), 0);
  }

  std::optional<SimEvent> process(Pending& next) {
    switch (next.kind) {
      case Kind::kTimer:
        return SimEvent{now_ns_, next.to, SimEvent::Kind::kTimer, {}};
      case Kind::kMessage:
        nodes_[next.to].inbox.push_back({next.from, std::move(next.payload)});
        return SimEvent{now_ns_, next.to, SimEvent::Kind::kDelivery, {}};
      case Kind::kPacket:
        return arrive(next);
      case Kind::kConnection:
      case Kind::kSender:
        meet(next);
        return std::nullopt;
      case Kind::kSilence:
        if (lasts(next)) fall_silent(next);
        return std::nullopt;
      case Kind::kBreak:
        if (lasts(next)) give_up(next);
        return std::nullopt;
      case Kind::kResume:
        break;
    }
    return std::nullopt;
  }

  void meet(const Pending& next) {
    const Connection& connection = connections_[unordered(next.from, next.to)];
    if (!connection.stands || connection.number != next.mark) return;
    const auto known = nodes_[next.to].streams.find(next.from);
    if (known == nodes_[next.to].streams.end()) return;
    if (next.kind == Kind::kConnection) {
      known->second.connected();
    } else {
      known->second.heard_of();
    }
    pump(next.to, next.from);
  }

  void fall_silent(const Pending& next) {
    const auto known = nodes_[next.to].streams.find(next.from);
    if (known == nodes_[next.to].streams.end()) return;
    known->second.fell_silent(session_of(next.from, next.from_life));
    take_loss(next.to, next.from, known->second);
  }

  void give_up(const Pending& next) {
    Connection& connection = connections_[unordered(next.from, next.to)];
    const bool has_successor = nodes_[next.from].running && nodes_[next.from].life != next.from_life;
    if (!has_successor) {
      connection.stands = false;
      notice_break(next.to, next.from);
    }
  }

  // Whether a packet is lost; those of connections that stand are not.
  bool is_lost(const Pending& next, const Connection& connection) {
    if (!lives(next.from, next.from_life)) {
      const auto last = last_words_.find({next.from, next.from_life});
      return last == last_words_.end() || now_ns_ > last->second;
    }
    return (!connection.stands || connection.number != next.mark) && draw_below(2) == 0;
  }

  std::optional<SimEvent> arrive(Pending& next) {
    Connection& connection = connections_[unordered(next.from, next.to)];
    if (is_way_cut(next.from, next.to)) {
      ways_[{next.from, next.to}].held.push_back(std::move(next));
      return std::nullopt;
    }
    if (is_lost(next, connection)) {
      ++counts_.lost;
      return std::nullopt;
    }
    if (options_.duplicates_one_in > 0 && draw_below(options_.duplicates_one_in) == 0) {
      ++counts_.duplicated;
      put(next, draw_below(spread()));
    }
    PeerStream& receiver = stream(next.to, next.from);
    next.packet.payload = next.payload;
    std::vector<Delivery> deliveries;
    receiver.accept(next.packet, deliveries);
    take_loss(next.to, next.from, receiver);
    pump(next.to, next.from);
    if (deliveries.empty()) return std::nullopt;
    Pending message;
    fill(message, Kind::kMessage, next.from, next.to);
    message.payload = std::move(deliveries.front().payload);
    if (options_.reorder) {
      put(std::move(message), draw_below(spread()));
      return std::nullopt;
    }
    return process(message);
  }

  std::mt19937_64 engine_;
  SimOptions options_;
  SimCounts counts_;
  std::uint64_t now_ns_ = 0;
  std::uint64_t next_order_ = 0;
  std::uint64_t last_outage_ = 0;
  std::uint64_t last_connection_ = 0;
  std::priority_queue<Pending, std::vector<Pending>, Later> queue_;
  std::vector<Pair> losses_;  // node and peer, to be told
  std::map<NodeId, Node> nodes_;
  std::map<Pair, Connection> connections_;
  std::map<Pair, Way> ways_;                                              // those that have been cut
  std::map<std::pair<NodeId, std::uint64_t>, std::uint64_t> last_words_;  // of those that were killed
  std::map<Pair, std::uint64_t> newest_ns_;
};

class SimNetwork::SimLink : public Link {
 public:
  SimLink(std::shared_ptr<State> state, NodeId self)
      : state_(std::move(state)), self_(self), life_(state_->start(self)) {}
  ~SimLink() override { state_->kill_life(self_, life_); }

  NodeId self() const override { return self_; }

  void send(NodeId to, std::string payload) override { state_->send(self_, life_, to, std::move(payload)); }

  std::vector<Delivery> receive(std::chrono::steady_clock::time_point) override {
    return state_->take_inbox(self_, life_);
  }

  void wake() override {}

 private:
  std::shared_ptr<State> state_;
  NodeId self_;
  std::uint64_t life_;
};

SimNetwork::SimNetwork(std::uint64_t seed, SimOptions options) {
  if (options.delay_ns_min > options.delay_ns_max) broken("empty range of delays", NodeId{0});
  state_ = std::make_shared<State>(seed, options);
}

SimNetwork::~SimNetwork() = default;

std::unique_ptr<Link> SimNetwork::connect(NodeId node) { return std::make_unique<SimLink>(state_, node); }
std::optional<SimEvent> SimNetwork::step() { return state_->step(); }
std::uint64_t SimNetwork::now_ns() const { return state_->now_ns(); }
void SimNetwork::set_timer(NodeId node, std::uint64_t time_ns) { state_->set_timer(node, time_ns); }
void SimNetwork::forget(NodeId node, NodeId peer) { state_->forget(node, peer); }
void SimNetwork::kill(NodeId node) { state_->kill(node); }
void SimNetwork::cut(NodeId a, NodeId b) {
  state_->cut(a, b);
  state_->cut(b, a);
}
void SimNetwork::cut_one_way(NodeId from, NodeId to) { state_->cut(from, to); }
void SimNetwork::heal(NodeId a, NodeId b) { state_->heal(a, b); }
void SimNetwork::break_connection(NodeId a, NodeId b) { state_->break_connection(a, b); }
void SimNetwork::stop(NodeId node, std::uint64_t until_ns) { state_->hold(node, until_ns, true); }
void SimNetwork::keep_busy(NodeId node, std::uint64_t until_ns) { state_->hold(node, until_ns, false); }
const SimCounts& SimNetwork::counts() const { return state_->counts(); }

}  // namespace tessera
