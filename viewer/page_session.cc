#include "viewer/page_session.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "client_sdk/live/sampling.h"
#include "client_sdk/src/status_json.h"
#include "viewer/json.h"
#include "viewer/page_requests.h"
#include "viewer/world_requests.h"

namespace tessera::viewer {
namespace {

using nlohmann::json;

constexpr int kFramesUnderWayMax = 2;
constexpr std::size_t kRequestsMax = 64;
constexpr std::size_t kTextsMax = 256;  // for a tab that does not read
constexpr double kHalfMax = 1e9;        // m
constexpr absl::Duration kSubscribeTimeout = absl::Seconds(10);
constexpr std::uint32_t kFramesPerSeamFrame = 4;  // seams change slowly
constexpr double kFramesPerSecondMin = 5;
constexpr std::uint64_t kNoWorld = 0;

// The index of a server among all servers, which determines its colour.
std::uint8_t place_of(const live::ClusterReport& report, std::uint64_t node) {
  const auto place = std::find(report.nodes.begin(), report.nodes.end(), node);
  return static_cast<std::uint8_t>(std::min<std::ptrdiff_t>(std::distance(report.nodes.begin(), place), 255));
}

json status_message(const live::ClusterReport& report, const Recorder& recorder) {
  json message = {{"type", "status"}, {"answers", report.answer.ok()}, {"status", to_json(report.cluster)}};
  if (!report.answer.ok()) message["why"] = std::string(report.answer.message());
  json nodes = json::array();
  for (const std::uint64_t node : report.nodes) nodes.push_back(absl::StrCat(absl::Hex(node)));
  message["nodes"] = std::move(nodes);
  message["recording"] = to_json(recorder.state());
  return message;
}

}  // namespace

PageSession::PageSession(Client& client, const PageOptions& options, PageSocket socket,
                         std::shared_ptr<const live::ClusterReport> report)
    : client_(client),
      options_(options),
      socket_(std::move(socket)),
      report_(std::move(report)),
      catalogue_(client),
      bodies_([this] { changed_.notify_all(); }),
      contacts_([this] { changed_.notify_all(); }),
      seams_([this] { changed_.notify_all(); }) {
  tell({{"type", "hello"},
        {"read_only", options_.read_only},
        {"may_load", options_.may_load && !options_.read_only}});
  writer_ = std::thread([this] { write(); });
  asker_ = std::thread([this] { answer_requests(); });
}

PageSession::~PageSession() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_all();
  writer_.join();
  asker_.join();
}

void PageSession::tell(const json& message) {
  texts_.push_back(dump(message));
  changed_.notify_all();
}

void PageSession::report(std::shared_ptr<const live::ClusterReport> report) {
  const std::lock_guard lock(mutex_);
  const bool is_other_world = report->world != report_->world;
  report_ = std::move(report);
  has_news_ = true;
  if (is_other_world) {
    watch();
  } else {
    watch_at_another_rate_where_needed();
  }
  changed_.notify_all();
}

double PageSession::frames_per_second() const {
  const double affordable =
      options_.states_per_second / static_cast<double>(std::max<std::size_t>(bodies_in_view_, 1));
  return std::min(std::max(affordable, kFramesPerSecondMin), options_.frames_per_second);
}

void PageSession::watch_at_another_rate_where_needed() {
  if (live::is_far_from(live::ticks_between_frames(*report_, frames_per_second()), every_ticks_)) watch();
}

bool PageSession::hear(const std::string& text) {
  const json message = message_from(text);
  if (!message.is_object() || !message.contains("type")) return false;
  const json& type = message["type"];
  const std::lock_guard lock(mutex_);
  if (type == "look") return look(message);
  if (type == "ask") return ask(message);
  if (type == "seen") {
    frames_under_way_ = std::max(0, frames_under_way_ - 1);
    changed_.notify_all();
    return true;
  }
  if ((type != "contacts" && type != "seams") || !message.contains("on")) return false;
  (type == "contacts" ? wants_contacts_ : wants_seams_) = message["on"] == true;
  watch();
  return true;
}

bool PageSession::look(const json& message) {
  const absl::StatusOr<WorldPosition> centre = position_from(message);
  const auto half = message.find("half");
  if (!centre.ok() || half == message.end() || !half->is_number()) return false;
  interest_ = Interest{*centre, std::clamp(half->get<double>(), 1.0, kHalfMax)};
  watch();
  return true;
}

bool PageSession::ask(const json& message) {
  if (!message.contains("id") || texts_.size() >= kTextsMax) return false;
  if (requests_.size() >= kRequestsMax) {
    tell({{"type", "answer"}, {"id", message["id"]}, {"error", "too many requests at once"}});
  } else {
    requests_.push_back(message);
    changed_.notify_all();
  }
  return true;
}

void PageSession::watch() {
  every_ticks_ = live::ticks_between_frames(*report_, frames_per_second());
  if (!interest_ || !report_->is_live()) {
    bodies_.watch({});
    contacts_.watch({});
    watches_contacts_ = false;
    seams_.watch({});
    return;
  }
  const Interest interest = known_in(*report_->cluster.settings, *interest_);
  const WatchedRegion region{interest.centre, Eigen::Vector3d::Constant(interest.half)};
  BodyFilter filter;
  // Bodies of frames that move are in no region of the world, and yet in view.
  if (report_->cluster.settings->frames.empty()) filter.region = region;
  filter.every_ticks = every_ticks_;
  filter.complete = true;
  bodies_.watch([this, filter] { return client_.watch_bodies(filter, kSubscribeTimeout); });
  // The contact stream covers the whole world: a new view keeps it, as a new stream would start empty.
  if (!wants_contacts_) {
    contacts_.watch({});
  } else if (!watches_contacts_) {
    contacts_.watch([this] { return client_.watch_contacts({.persisting = true}, kSubscribeTimeout); });
  }
  watches_contacts_ = wants_contacts_;
  if (wants_seams_) {
    const SeamFilter seams{region, every_ticks_ == 1 ? 1 : kFramesPerSeamFrame * every_ticks_};
    seams_.watch([this, seams] { return client_.watch_seams(seams, kSubscribeTimeout); });
  } else {
    seams_.watch({});
  }
}

bool PageSession::is_due(Clock::time_point now) const {
  return interest_ && frames_under_way_ < kFramesUnderWayMax && now >= next_frame_ &&
         (bodies_.has_frame() || contacts_.has_frame() || seams_.has_frame());
}

void PageSession::write() {
  const auto period = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(0.8 / options_.frames_per_second));  // frames arrive unevenly
  std::unique_lock lock(mutex_);
  while (!closing_) {
    if (!texts_.empty()) {
      const std::string text = std::move(texts_.front());
      texts_.pop_front();
      lock.unlock();
      socket_.send_text(text);
      lock.lock();
    } else if (has_news_) {
      has_news_ = false;
      const std::shared_ptr<const live::ClusterReport> report = report_;
      lock.unlock();
      socket_.send_text(dump(status_message(*report, *options_.recorder)));
      lock.lock();
    } else if (const std::uint64_t read = options_.looks->files_read(); read != looks_read_) {
      // What was told of bodies before is told once more.
      looks_read_ = read;
      told_world_ = kNoWorld;
      watch();
    } else if (is_due(Clock::now())) {
      next_frame_ = Clock::now() + period;
      const std::shared_ptr<const live::ClusterReport> report = report_;
      const Interest interest = *interest_;
      lock.unlock();
      show(report, interest);
      lock.lock();
    } else {
      // A frame may have arrived before this wait: check again after a period at the latest.
      changed_.wait_for(lock, period);
    }
  }
}

void PageSession::show(const std::shared_ptr<const live::ClusterReport>& report, const Interest& interest) {
  if (!report->is_live()) return;
  const bool has_new_view = start_over_where_needed(*report, interest);
  const auto count_frame = [&] {
    const std::lock_guard lock(mutex_);
    ++frames_under_way_;
  };
  const auto send = [&](const std::string& frame) {
    if (frame.empty()) return;
    count_frame();
    socket_.send_binary(frame);
  };
  if (const std::optional<BodyFrame> frame = bodies_.take()) {
    {
      const std::lock_guard lock(mutex_);
      bodies_in_view_ = frame->bodies.size();
      watch_at_another_rate_where_needed();
    }
    std::vector<SeenBody> bodies = seen(*report, *frame);
    introduce(report->cluster.world, bodies);
    send(encoder_.encode(frame->tick, std::move(bodies)));
  }
  std::optional<ContactFrame> contacts = contacts_.take();
  const bool has_contacts = contacts.has_value() || (has_new_view && last_contacts_);
  if (contacts) last_contacts_ = std::move(contacts);
  if (has_contacts) send(encode(last_contacts_->tick, view_->see(*last_contacts_)));
  if (const std::optional<SeamFrame> frame = seams_.take()) {
    count_frame();
    socket_.send_text(dump(seen(*report, *frame)));
  }
}

bool PageSession::Sky::is_near(const Sky& other) const {
  constexpr double kAngleMax = 1e-3;
  return up.isApprox(other.up, kAngleMax) && planet.has_value() == other.planet.has_value() &&
         (!planet || planet->isApprox(*other.planet, kAngleMax));
}

bool PageSession::start_over_where_needed(const live::ClusterReport& report, const Interest& interest) {
  if (report.world != told_world_) {
    told_world_ = report.world;
    counted_bodies_ = 0;
    catalogue_.clear();
    told_bodies_.clear();
    told_shapes_.clear();
    told_looks_.clear();
    view_.reset();
    last_contacts_.reset();
    socket_.send_text(dump({{"type", "world"}, {"world", report.cluster.world}}));
  }
  const bool has_new_statics = counted_bodies_ != report.cluster.bodies && catalogue_.learn_statics().ok();
  if (has_new_statics) counted_bodies_ = report.cluster.bodies;
  PageView view(known_in(*report.cluster.settings, interest), *report.cluster.settings);
  if (view_) view.go_on_from(*view_);
  const Sky sky{view.up(report.cluster.tick), view.planet(report.cluster.tick)};
  if (!view_ || view_->sector() != view.sector() || !told_sky_.is_near(sky)) {
    encoder_.start_over();
    socket_.send_text(dump(view.describe(report.cluster.tick)));
    told_sky_ = sky;
  }
  const bool is_new = !view_ || view_->interest() != view.interest();
  if (has_new_statics || is_new) statics_ = view.see_statics(catalogue_, report.cluster.tick);
  view_ = view;
  return is_new;
}

std::vector<SeenBody> PageSession::seen(const live::ClusterReport& report, const BodyFrame& frame) {
  std::vector<SeenBody> moving;
  moving.reserve(frame.bodies.size());
  view_->see_carriers(frame);
  for (const BodySample& body : frame.bodies) {
    const SeenBody seen = view_->see(body, place_of(report, body.server), frame.tick);
    if (!view_->has_frames() || view_->holds(seen)) moving.push_back(seen);
  }
  if (view_->has_frames()) statics_ = view_->see_statics(catalogue_, frame.tick);
  std::vector<SeenBody> all;
  all.reserve(moving.size() + statics_.size());
  std::merge(moving.begin(), moving.end(), statics_.begin(), statics_.end(), std::back_inserter(all),
             [](const SeenBody& a, const SeenBody& b) { return a.id < b.id; });
  return all;
}

json PageSession::seen(const live::ClusterReport& report, const SeamFrame& frame) const {
  json clones = json::array();
  for (const CloneSample& clone : frame.clones) {
    clones.push_back({{"body", clone.body.value}, {"server", place_of(report, clone.server)}});
  }
  json islands = json::array();
  for (const IslandSample& island : frame.islands) {
    json bodies = json::array();
    for (const BodyId id : island.bodies) bodies.push_back(id.value);
    islands.push_back({{"id", island.id.value}, {"bodies", std::move(bodies)}});
  }
  return {{"type", "seams"}, {"clones", std::move(clones)}, {"islands", std::move(islands)}};
}

void PageSession::introduce(const std::string& world, const std::vector<SeenBody>& bodies) {
  std::vector<BodyId> strangers;
  for (const SeenBody& body : bodies) {
    if (!told_bodies_.contains(BodyId{body.id})) strangers.push_back(BodyId{body.id});
  }
  if (strangers.empty() || !catalogue_.learn(strangers).ok()) return;
  json described = json::array();
  json shapes = json::object();
  json looks = json::object();
  for (const BodyId id : strangers) {
    const FoundBody* body = catalogue_.find(id);
    if (body == nullptr) continue;
    told_bodies_.insert(id);
    described.push_back(to_json(*body));
    const ShapeId shape = body->properties.shape;
    if (told_shapes_.insert(shape).second) shapes[absl::StrCat(shape)] = to_json(catalogue_.shape(shape));
    const std::shared_ptr<const Look> look = options_.looks->of(world, body->name);
    if (!look) continue;
    const auto [told, is_new] = told_looks_.try_emplace(look, told_looks_.size());
    if (is_new) looks[absl::StrCat(told->second)] = to_json(*look);
    described.back()["look"] = told->second;
  }
  socket_.send_text(dump({{"type", "bodies"},
                          {"bodies", std::move(described)},
                          {"shapes", std::move(shapes)},
                          {"looks", std::move(looks)}}));
}

void PageSession::answer_requests() {
  std::optional<NewBody> removed;
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return closing_ || !requests_.empty(); });
    if (closing_) return;
    const json request = std::move(requests_.front());
    requests_.pop_front();
    const std::shared_ptr<const live::ClusterReport> report = report_;
    lock.unlock();
    json message = answer({client_, *report, options_, removed}, request);
    lock.lock();
    message["type"] = "answer";
    message["id"] = request["id"];
    tell(message);
  }
}

}  // namespace tessera::viewer
