#include "transport/sim_network.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <queue>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace tessera {
namespace {

// A pending message, timer or loss notice. `order` sorts events of the same moment: first set, first run.
struct Pending {
  std::uint64_t time_ns = 0;
  std::uint64_t order = 0;
  SimEvent::Kind kind = SimEvent::Kind::kDelivery;
  NodeId from;
  NodeId to;
  // The incarnations of `from` and `to` that this belongs to: a restarted node does not inherit it.
  std::uint64_t from_life = 0;
  std::uint64_t to_life = 0;
  std::uint64_t cut = 0;  // of a loss: the cut that caused it; 0 if `from` was killed
  std::string payload;
};

struct Later {
  bool operator()(const Pending& a, const Pending& b) const {
    return std::pair(a.time_ns, a.order) > std::pair(b.time_ns, b.order);
  }
};

struct Node {
  // Counts the kills: a node that has not started yet is already in its first incarnation, so that messages
  // wait for it.
  std::uint64_t life = 0;
  bool running = false;
  std::vector<Delivery> inbox;
};

struct Cut {
  std::uint64_t number = 0;  // from 1: the same link may be cut again
  std::vector<Pending> held;
};

using Pair = std::pair<NodeId, NodeId>;

Pair unordered(NodeId a, NodeId b) { return std::minmax(a, b); }

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
    std::vector<Pending> waiting = std::move(waiting_[id]);
    waiting_.erase(id);
    for (Pending& message : waiting) set_out(std::move(message));
    return node.life;
  }

  void kill(NodeId id) {
    Node& node = nodes_[id];
    ++node.life;
    node.running = false;
    node.inbox.clear();
    waiting_.erase(id);
    dead_.insert(id);
    for (const auto& [other, witness] : nodes_) {
      if (witness.running) announce_loss(id, other, 0);
    }
  }

  void kill_life(NodeId id, std::uint64_t life) {
    if (lives(id, life)) kill(id);
  }

  void send(NodeId from, std::uint64_t from_life, NodeId to, std::string payload) {
    if (!lives(from, from_life)) return;
    Node& receiver = nodes_[to];
    if (!receiver.running && dead_.contains(to)) return;
    Pending message{.kind = SimEvent::Kind::kDelivery,
                    .from = from,
                    .to = to,
                    .from_life = from_life,
                    .to_life = receiver.life,
                    .payload = std::move(payload)};
    if (receiver.running) {
      set_out(std::move(message));
    } else {
      waiting_[to].push_back(std::move(message));
    }
  }

  std::vector<Delivery> take_inbox(NodeId id, std::uint64_t life) {
    if (!lives(id, life)) return {};
    return std::exchange(nodes_[id].inbox, {});
  }

  void set_timer(NodeId id, std::uint64_t time_ns) {
    const std::uint64_t life = nodes_[id].life;
    queue_.push(Pending{.time_ns = std::max(time_ns, now_ns_),
                        .order = next_order_++,
                        .kind = SimEvent::Kind::kTimer,
                        .from = id,
                        .to = id,
                        .from_life = life,
                        .to_life = life});
  }

  void cut(NodeId a, NodeId b) {
    const auto [cut, is_new] = cuts_.try_emplace(unordered(a, b));
    if (!is_new) return;
    cut->second.number = ++last_cut_;
    announce_loss(a, b, last_cut_);
    announce_loss(b, a, last_cut_);
  }

  void heal(NodeId a, NodeId b) {
    auto healed = cuts_.extract(unordered(a, b));
    if (healed.empty()) return;
    for (Pending& message : healed.mapped().held) set_out(std::move(message));
  }

  std::optional<SimEvent> step() {
    while (!queue_.empty()) {
      // The queue exposes its top as const only; it is popped immediately, so moving out of it is safe.
      Pending next = std::move(const_cast<Pending&>(queue_.top()));
      queue_.pop();
      if (!lives(next.from, next.from_life) || !lives(next.to, next.to_life)) continue;
      const auto cut = cuts_.find(unordered(next.from, next.to));
      const bool is_loss = next.kind == SimEvent::Kind::kLoss;
      if (is_loss && next.cut != 0 && (cut == cuts_.end() || cut->second.number != next.cut)) continue;
      if (next.kind == SimEvent::Kind::kDelivery) {
        if (cut != cuts_.end()) {
          cut->second.held.push_back(std::move(next));
          continue;
        }
        nodes_[next.to].inbox.push_back({next.from, std::move(next.payload)});
      }
      now_ns_ = next.time_ns;
      return SimEvent{now_ns_, next.to, next.kind, is_loss ? next.from : NodeId{}};
    }
    return std::nullopt;
  }

  std::uint64_t now_ns() const { return now_ns_; }

 private:
  bool lives(NodeId id, std::uint64_t life) const {
    const auto node = nodes_.find(id);
    return node != nodes_.end() && node->second.life == life;
  }

  // Draws the delay by hand, because the standard's distributions differ between libraries. The bias of the
  // remainder, below 2^-40 for any sensible range, does not matter here.
  std::uint64_t draw_delay_ns() {
    const std::uint64_t span = options_.delay_ns_max - options_.delay_ns_min + 1;
    return options_.delay_ns_min + (span == 0 ? engine_() : engine_() % span);
  }

  void announce_loss(NodeId lost, NodeId to, std::uint64_t cut) {
    if (options_.lease_ns == 0) return;
    queue_.push(Pending{.time_ns = now_ns_ + options_.lease_ns,
                        .order = next_order_++,
                        .kind = SimEvent::Kind::kLoss,
                        .from = lost,
                        .to = to,
                        .from_life = nodes_[lost].life,
                        .to_life = nodes_[to].life,
                        .cut = cut});
  }

  void set_out(Pending message) {
    message.time_ns = now_ns_ + draw_delay_ns();
    if (!options_.reorder) {
      std::uint64_t& newest = newest_ns_[{message.from, message.to}];
      newest = std::max(newest, message.time_ns);
      message.time_ns = newest;
    }
    message.order = next_order_++;
    queue_.push(std::move(message));
  }

  std::mt19937_64 engine_;
  SimOptions options_;
  std::uint64_t now_ns_ = 0;
  std::uint64_t next_order_ = 0;
  std::priority_queue<Pending, std::vector<Pending>, Later> queue_;
  std::map<NodeId, Node> nodes_;
  std::set<NodeId> dead_;
  // Messages to nodes that have not started yet, in order of sending.
  std::map<NodeId, std::vector<Pending>> waiting_;
  std::map<Pair, Cut> cuts_;  // cut links, with the messages that they hold back
  std::uint64_t last_cut_ = 0;
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
void SimNetwork::kill(NodeId node) { state_->kill(node); }
void SimNetwork::cut(NodeId a, NodeId b) { state_->cut(a, b); }
void SimNetwork::heal(NodeId a, NodeId b) { state_->heal(a, b); }

}  // namespace tessera
