#include "client_sdk/src/body_frames.h"

#include <algorithm>
#include <optional>

namespace tessera {
namespace {

bool is_same(const BodySample& a, const BodySample& b) {
  return a.asleep == b.asleep && a.pose.position.sector == b.pose.position.sector &&
         a.pose.position.local == b.pose.position.local &&
         a.pose.orientation.coeffs() == b.pose.orientation.coeffs() &&
         a.linear_velocity == b.linear_velocity && a.angular_velocity == b.angular_velocity;
}

}  // namespace

BodyFrame KnownBodies::take(const BodyNews& news) {
  lost_.clear();
  note_lost(news);
  BodyFrame frame = frame_of(news.tick, news.bodies);
  frame.deferred = news.deferred;
  return frame;
}

BodyFrame KnownBodies::replace(Tick tick, const std::vector<BodySample>& all) {
  lost_.clear();
  for (const auto& [id, body] : known_) lost_.emplace(id, body.server);
  return frame_of(tick, all);
}

BodyFrame KnownBodies::frame_of(Tick tick, const std::vector<BodySample>& told) {
  BodyFrame frame;
  frame.tick = tick;
  std::optional<BodyNews::Gone> last;
  for (const BodySample& body : told) {
    if (last && last->id == body.id) {
      also_at_.insert_or_assign(body.id, body.server);
      continue;
    }
    last = {body.id, body.server};
    lost_.erase(body.id);
    also_at_.erase(body.id);
    const auto [place, is_new] = known_.try_emplace(body.id, body);
    const bool is_repeated = !is_new && body.asleep && is_same(place->second, body);
    place->second = body;
    if (!complete_ && !is_repeated) frame.bodies.push_back(body);
  }
  for (const auto& [id, server] : lost_) {
    known_.erase(id);
    frame.gone.push_back(id);
  }
  if (!complete_) return frame;
  frame.bodies.reserve(known_.size());
  for (const auto& [id, body] : known_) frame.bodies.push_back(body);
  return frame;
}

void KnownBodies::note_lost(const BodyNews& news) {
  std::vector<std::uint64_t> servers = news.servers;
  std::sort(servers.begin(), servers.end());
  if (servers != servers_ || !news.whole.empty()) {
    const auto has = [](const std::vector<std::uint64_t>& list, std::uint64_t server) {
      return std::find(list.begin(), list.end(), server) != list.end();
    };
    std::vector<BodyNews::Gone> untold;
    for (const auto& [id, body] : known_) {
      if (!has(servers, body.server) || has(news.whole, body.server)) untold.push_back({id, body.server});
    }
    for (const BodyNews::Gone& gone : untold) lose(gone);
    servers_ = std::move(servers);
  }
  for (const BodyNews::Gone& gone : news.gone) lose(gone);
}

void KnownBodies::lose(const BodyNews::Gone& gone) {
  const auto other = also_at_.find(gone.id);
  const auto known = known_.find(gone.id);
  if (known == known_.end()) return;
  if (other == also_at_.end()) {
    if (known->second.server == gone.server) lost_.emplace(gone.id, gone.server);
    return;
  }
  if (gone.server != known->second.server && gone.server != other->second) return;
  if (gone.server == known->second.server) known->second.server = other->second;
  also_at_.erase(other);
}

}  // namespace tessera
