// Bodies around one that moves: streams of regions, one after the other.
#pragma once

#include <absl/time/clock.h>

#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "client_sdk/src/body_frames.h"
#include "tessera/stream.h"

namespace tessera {

// Servers stream a region that is larger than what is wanted by a margin; the exact box is cut out here, at
// each tick, around where the body is. Once the body has gone half of the margin, a stream of the region
// around it takes the place of the other, at a tick that both have: no tick is lost.
class FollowedBodies final : public BodyStream {
 public:
  // Subscribes to all bodies of a region, in complete frames.
  using Open = std::function<absl::StatusOr<std::unique_ptr<BodyStream>>(const WatchedRegion&)>;

  // `leader` streams the body that is followed, in complete frames. NOT_FOUND if there is none; otherwise
  // errors as `open`, or those of the leader's first frame. `how` later regions are opened; next() does not
  // wait for them.
  static absl::StatusOr<std::unique_ptr<BodyStream>> create(std::unique_ptr<BodyStream> leader,
                                                            const BodyFilter& filter, double sector_size,
                                                            Open open, absl::Duration timeout,
                                                            std::launch how = std::launch::async);

  absl::StatusOr<BodyFrame> next(absl::Duration timeout) override;
  void cancel() override;
  std::uint64_t skipped() const override;

 private:
  struct Around {
    WatchedRegion region;
    double margin;  // m, beyond what is wanted
  };
  struct Area {
    Around around;
    std::shared_ptr<BodyStream> stream;
    std::optional<BodyFrame> frame;  // the last that was read
  };

  FollowedBodies(std::unique_ptr<BodyStream> leader, const BodyFilter& filter, double sector_size, Open open,
                 std::launch how)
      : leader_(std::move(leader)),
        filter_(filter),
        sector_size_(sector_size),
        open_(std::move(open)),
        how_(how),
        shown_(filter.complete) {}

  Around around_here() const;
  Eigen::Vector3d away(const WorldPosition& position, const WorldPosition& centre) const;
  absl::StatusOr<Area> opened(const Around& around) const;
  void use(Area area);
  static absl::Status read_to(Tick tick, Area& area, absl::Time deadline);
  void look_for_next_area();
  void change_area_where_ready(Tick tick);
  bool is_better(const Area& area) const;
  BodyFrame cut();

  const std::unique_ptr<BodyStream> leader_;
  const BodyFilter filter_;
  const double sector_size_;
  const Open open_;
  const std::launch how_;

  BodySample place_;                // of the leader, as it was told last
  std::optional<BodyFrame> frame_;  // of the leader
  Area area_;
  std::optional<Area> coming_;
  std::future<absl::StatusOr<Area>> opening_;
  WorldPosition opened_from_;  // of the leader, when that began
  double way_ = 0;             // m, that it went until the last one that was opened was of use
  KnownBodies shown_;
  std::uint64_t unmatched_ = 0;  // ticks that only one of the streams has

  std::mutex mutex_;  // guards the following
  std::shared_ptr<BodyStream> in_use_;
  bool cancelled_ = false;
};

}  // namespace tessera
