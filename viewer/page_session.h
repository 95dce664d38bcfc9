// The session of one tab of the web UI: what it looks at, and what it has been sent.
//
// The tab sends as JSON {"type": "look", position, "half"} for its camera, {"type": "contacts" or "seams",
// "on"} for optional marks, {"type": "seen"} for every frame that it has drawn, and {"type": "ask", "id",
// "do", ...} (page_requests.h). It receives "hello", "status", "world" (a new world voids all earlier
// messages), "view" (the sector that points are relative to), "bodies" with "shapes" and "looks" (when they
// first come into view), "answer", and frames: binary ones (frame_encoder.h) and "seams". At most two frames
// are in flight, so a tab that draws slowly gets fewer.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/time/time.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client_sdk/live/body_catalogue.h"
#include "client_sdk/live/cluster_monitor.h"
#include "client_sdk/live/latest_frame.h"
#include "tessera/client.h"
#include "viewer/frame_encoder.h"
#include "viewer/page_options.h"
#include "viewer/page_view.h"

namespace tessera::viewer {

// Send to the tab; both block while the network does.
struct PageSocket {
  std::function<void(const std::string&)> send_text;
  std::function<void(const std::string&)> send_binary;
};

// Any thread may call hear() and report().
class PageSession {
 public:
  PageSession(Client& client, const PageOptions& options, PageSocket socket,
              std::shared_ptr<const live::ClusterReport> report);
  ~PageSession();

  // Handles a text message of the tab. False if it is invalid, or the tab does not read the answers.
  bool hear(const std::string& text);

  void report(std::shared_ptr<const live::ClusterReport> report);

 private:
  using Clock = std::chrono::steady_clock;

  bool look(const nlohmann::json& message);
  bool ask(const nlohmann::json& message);
  void tell(const nlohmann::json& message);   // with the lock held
  void watch();                               // likewise
  void watch_at_another_rate_where_needed();  // likewise
  double frames_per_second() const;           // likewise
  bool is_due(Clock::time_point now) const;   // likewise

  void write();
  void answer_requests();

  // On the writing thread, which owns the data.
  void show(const std::shared_ptr<const live::ClusterReport>& report, const Interest& interest);
  // Whether the view has changed.
  bool start_over_where_needed(const live::ClusterReport& report, const Interest& interest);
  void introduce(const std::string& world, const std::vector<SeenBody>& bodies);
  std::vector<SeenBody> seen(const live::ClusterReport& report, const BodyFrame& frame);
  nlohmann::json seen(const live::ClusterReport& report, const SeamFrame& frame) const;

  Client& client_;
  const PageOptions options_;
  const PageSocket socket_;

  std::mutex mutex_;
  std::condition_variable changed_;
  bool closing_ = false;
  std::shared_ptr<const live::ClusterReport> report_;
  bool has_news_ = true;  // a report that has not been sent
  std::optional<Interest> interest_;
  bool wants_contacts_ = false;
  bool watches_contacts_ = false;
  bool wants_seams_ = false;
  std::uint32_t every_ticks_ = 0;   // of the open streams
  std::size_t bodies_in_view_ = 0;  // in the last frame, without static ones
  std::deque<std::string> texts_;
  std::deque<nlohmann::json> requests_;
  int frames_under_way_ = 0;
  Clock::time_point next_frame_{};

  // Owned by the writing thread.
  live::BodyCatalogue catalogue_;
  FrameEncoder encoder_;
  std::optional<PageView> view_;
  // What changes of a view in a frame that turns or goes around a planet, as the page was told.
  struct Sky {
    Eigen::Vector3d up = Eigen::Vector3d::Zero();
    std::optional<Eigen::Vector3d> planet;  // m

    bool is_near(const Sky& other) const;
  } told_sky_;
  std::vector<SeenBody> statics_;
  std::optional<ContactFrame> last_contacts_;  // a paused world streams them only once
  absl::flat_hash_set<BodyId> told_bodies_;
  absl::flat_hash_set<ShapeId> told_shapes_;
  std::uint64_t looks_read_ = 0;  // FileLooks::files_read() when bodies were last told of
  absl::flat_hash_map<std::shared_ptr<const Look>, std::size_t> told_looks_;  // by their numbers on the page
  std::uint64_t told_world_ = 0;
  std::uint64_t counted_bodies_ = 0;  // of the world, when its static bodies were requested

  live::LatestFrame<BodyFrame> bodies_;
  live::LatestFrame<ContactFrame> contacts_;
  live::LatestFrame<SeamFrame> seams_;
  std::thread writer_;
  std::thread asker_;
};

}  // namespace tessera::viewer
