// Frames of bodies, made from what servers tell of changes.
#pragma once

#include <absl/container/btree_map.h>

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "client_sdk/src/body_news.h"

namespace tessera {

// The bodies of a stream as they were told last.
class KnownBodies {
 public:
  // `complete`: as in BodyFilter.
  explicit KnownBodies(bool complete) : complete_(complete) {}

  // The frame of the next tick. What servers tell again without need is not in it.
  BodyFrame take(const BodyNews& news);
  // Likewise, where `all` are the bodies of that tick, ascending by id.
  BodyFrame replace(Tick tick, const std::vector<BodySample>& all);

 private:
  BodyFrame frame_of(Tick tick, const std::vector<BodySample>& told);
  void note_lost(const BodyNews& news);
  void lose(const BodyNews::Gone& gone);

  const bool complete_;
  absl::btree_map<BodyId, BodySample> known_;
  // Two servers told of them at one tick, between which they moved: the one that is not in `known_`.
  std::map<BodyId, std::uint64_t> also_at_;
  std::vector<std::uint64_t> servers_;           // of the last tick, ascending
  absl::btree_map<BodyId, std::uint64_t> lost_;  // at this tick, if no server has them
};

class FramesOfBodies final : public BodyStream {
 public:
  FramesOfBodies(std::unique_ptr<Stream<BodyNews>> news, bool complete)
      : news_(std::move(news)), known_(complete) {}

  absl::StatusOr<BodyFrame> next(absl::Duration timeout) override {
    const absl::StatusOr<BodyNews> news = news_->next(timeout);
    if (!news.ok()) return news.status();
    return known_.take(*news);
  }
  void cancel() override { news_->cancel(); }
  std::uint64_t skipped() const override { return news_->skipped(); }

 private:
  std::unique_ptr<Stream<BodyNews>> news_;
  KnownBodies known_;
};

}  // namespace tessera
