#include "ros/feed.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "client_sdk/live/sampling.h"
#include "daemon/log.h"
#include "worlds/loader/model_file.h"

namespace tessera::ros {
namespace {

constexpr absl::Duration kStatusPeriod = absl::Milliseconds(250);
constexpr absl::Duration kTimeout = absl::Seconds(5);
constexpr std::uint64_t kFramesAsked = 100'000;  // the coordinator's maximum
constexpr std::chrono::seconds kRepeatAfter{1};  // all transforms, for late joiners

// Of programs, a frame tells those that have changed.
void add_changes(ProgramFrame& kept, ProgramFrame next) {
  kept.tick = next.tick;
  for (ProgramSample& sample : next.programs) {
    const auto same = std::ranges::find_if(kept.programs, [&](const ProgramSample& other) {
      return other.body == sample.body && other.program == sample.program;
    });
    if (same == kept.programs.end()) {
      kept.programs.push_back(std::move(sample));
    } else {
      *same = std::move(sample);
    }
  }
}

// Why there is nothing to publish; empty if there is something.
std::string obstacle_in(const live::ClusterReport& report) {
  if (!report.answer.ok()) return std::string(report.answer.message());
  if (report.cluster.state == "failed") return report.cluster.failure;
  return report.is_live() ? "" : "the cluster has no world yet";
}

}  // namespace

Feed::Feed(Client& client, Node& node, Publisher publisher, const FeedOptions& options)
    : client_(client),
      publisher_(publisher),
      options_(options),
      period_(std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / options.rate))),
      catalogue_(client),
      robots_(node, options.robots, [this] { notify(); }),
      monitor_(client, kStatusPeriod,
               [this](std::shared_ptr<const live::ClusterReport> report) {
                 const std::lock_guard lock(mutex_);
                 news_ = std::move(report);
                 changed_.notify_all();
               }),
      thread_([this] { run(); }) {}

void Feed::notify() {
  const std::lock_guard lock(mutex_);
  changed_.notify_all();
}

Feed::~Feed() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void Feed::run() {
  std::unique_lock lock(mutex_);
  while (!closing_) {
    const std::shared_ptr<const live::ClusterReport> report = std::exchange(news_, nullptr);
    lock.unlock();
    if (report) hear(*report);
    if (robots_.is_commanded()) robots_.carry_out(client_, frame_ ? frame_->tick : 0, time_step_);
    const Clock::time_point now = Clock::now();
    if (now >= next_publication_) publish(now);
    lock.lock();
    const bool may_publish = now >= next_publication_;
    changed_.wait_until(lock, may_publish ? next_repetition_ : next_publication_, [&] {
      return closing_ || news_ || robots_.is_commanded() || (may_publish && bodies_ && bodies_->has_frame());
    });
  }
}

void Feed::hear(const live::ClusterReport& report) {
  const std::string obstacle = obstacle_in(report);
  if (!obstacle.empty() && obstacle != obstacle_) log_warning(absl::StrCat("waiting: ", obstacle));
  obstacle_ = obstacle;
  if (!report.is_live()) {
    bodies_.reset();
    programs_.reset();
    joints_.reset();
    frame_.reset();
    return;
  }
  if (report.world != world_) enter(report);
  if (report.cluster.bodies != counted_bodies_) {
    if (const absl::Status status = look_up(report.cluster.tick); !status.ok()) {
      return warn(status);  // try again with the next report
    }
    counted_bodies_ = report.cluster.bodies;
  }
  const std::uint32_t every_ticks = live::ticks_between_frames(report, options_.rate);
  if (ids_ != filter_.ids || live::is_far_from(every_ticks, filter_.every_ticks)) watch(every_ticks);
}

void Feed::enter(const live::ClusterReport& report) {
  const WorldSettings& settings = *report.cluster.settings;
  world_ = report.world;
  sector_ = options_.sector.value_or(report.cluster.anchor);
  sector_size_ = settings.sector_size;
  time_step_ = settings.time_step;
  catalogue_.clear();
  counted_bodies_.reset();
  ids_.clear();
  filter_ = {.every_ticks = 0};
  frame_.reset();
  transforms_.emplace(options_.frame, sector_, settings, options_.robots.root);
  robots_.forget();
  measuring_.clear();
  watched_joints_.clear();
  bodies_.emplace([this] { notify(); });
  programs_.emplace([] {}, add_changes);
  joints_.emplace([] {});
  log_info(absl::StrCat("world ", report.cluster.world, ": ", options_.frame, " is the centre of sector ",
                        to_string(sector_)));
}

absl::Status Feed::look_up(Tick tick) {
  std::vector<BodyId> ids;
  // An unused id: a stream without bodies still carries the time, while a filter without ids selects all
  // bodies.
  if (!options_.bodies.empty()) ids.push_back(BodyId{});
  for (const std::string& name : options_.bodies) {
    const absl::StatusOr<FoundBody> body = client_.find(name, kTimeout);
    if (absl::IsNotFound(body.status())) {
      warn(body.status());
    } else if (!body.ok()) {
      return body.status();
    } else if (body->properties.motion != Motion::kStatic) {
      ids.push_back(body->id);
    }
  }
  if (absl::Status status = catalogue_.learn_statics(); !status.ok()) return status;
  BodyFrame chosen{tick, {}};
  for (const live::StaticBody& body : catalogue_.statics()) {
    const BodySample& sample = body.sample;
    const std::string& name = catalogue_.find(sample.id)->name;
    if (!is_chosen(name, sample.pose.position)) continue;
    transforms_->name(sample.id, name);
    chosen.bodies.push_back(sample);
  }
  std::vector<std::string> models;
  for (const std::string& name : options_.bodies) models.push_back(model_of(name));
  if (absl::Status status = robots_.learn(client_, models, kTimeout); !status.ok()) return status;
  watch_robots();
  const absl::StatusOr<std::vector<TransformStamped>> frames = look_up_frames(tick);
  if (!frames.ok()) return frames.status();
  ids_ = std::move(ids);
  if (options_.transforms == Told::kNothing) return absl::OkStatus();
  std::vector<TransformStamped> transforms = *frames;
  if (options_.transforms == Told::kBodies) {
    const std::vector<TransformStamped> statics = transforms_->all(chosen);
    transforms.insert(transforms.end(), statics.begin(), statics.end());
  }
  return publisher_.publish_static_transforms(transforms);
}

// Those of the bodies that are published.
absl::StatusOr<std::vector<TransformStamped>> Feed::look_up_frames(Tick tick) {
  const absl::StatusOr<FoundFrames> found = client_.find_frames("", kFramesAsked, kTimeout);
  if (!found.ok()) return found.status();
  if (found->truncated) {
    warn(absl::ResourceExhaustedError(
        absl::StrCat("only the first ", kFramesAsked, " frames of models are published")));
  }
  const std::vector<std::string>& names = options_.bodies;
  std::vector<FoundFrame> chosen;
  for (const FoundFrame& frame : found->frames) {
    if (names.empty() || std::find(names.begin(), names.end(), frame.body_name) != names.end())
      chosen.push_back(frame);
  }
  const std::vector<FoundFrame> sensors = robots_.frames();
  chosen.insert(chosen.end(), sensors.begin(), sensors.end());
  return transforms_->fixed(chosen, tick);
}

bool Feed::is_chosen(const std::string& name, const WorldPosition& position) const {
  const std::vector<std::string>& names = options_.bodies;
  if (!names.empty()) return std::find(names.begin(), names.end(), name) != names.end();
  return (relative_to(position, sector_, sector_size_).cwiseAbs().array() <= options_.reach).all();
}

void Feed::watch(std::uint32_t every_ticks) {
  filter_ = {.ids = ids_, .every_ticks = every_ticks, .complete = true};
  if (ids_.empty()) {
    filter_.region =
        WatchedRegion{{sector_, Eigen::Vector3d::Zero()}, Eigen::Vector3d::Constant(options_.reach)};
  }
  bodies_->watch([this, filter = filter_] { return client_.watch_bodies(filter, kTimeout); });
}

// Where these are not those that are watched.
void Feed::watch_robots() {
  if (std::vector<BodyId> bodies = robots_.measuring_bodies(); bodies != measuring_) {
    measuring_ = std::move(bodies);
    live::LatestFrame<ProgramFrame>::Open open;
    if (!measuring_.empty())
      open = [this, ids = measuring_] { return client_.watch_programs({.ids = ids}, kTimeout); };
    programs_->watch(std::move(open));
  }
  std::vector<JointId> joints;
  for (const FoundJoint& joint : robots_.joints()) joints.push_back(joint.id);
  if (joints == watched_joints_) return;
  watched_joints_ = std::move(joints);
  live::LatestFrame<JointFrame>::Open open;
  if (!watched_joints_.empty())
    open = [this, found = robots_.joints()] { return client_.watch_joints(found, 1, kTimeout); };
  joints_->watch(std::move(open));
}

void Feed::publish(Clock::time_point now) {
  std::optional<BodyFrame> news = bodies_ ? bodies_->take() : std::nullopt;
  const bool is_repetition = now >= next_repetition_;
  if (is_repetition) next_repetition_ = now + kRepeatAfter;
  if (!news && !(is_repetition && frame_)) return;
  next_publication_ = now + period_;
  if (news) frame_ = *news;
  introduce(*frame_);
  if (std::optional<ProgramFrame> measured = programs_->take()) robots_.take(*std::move(measured));
  if (std::optional<JointFrame> joints = joints_->take()) robots_.take(*std::move(joints));
  std::vector<TransformStamped> transforms;
  if (options_.transforms == Told::kBodies) {
    transforms = transforms_->changed(*frame_);
    if (is_repetition) transforms = transforms_->all(*frame_);
  } else if (options_.transforms == Told::kWays) {
    transforms = robots_.ways(frame_->tick, time_step_);
  }
  // The clock last: once a time is published, its transforms and measurements are available.
  if (!transforms.empty()) warn(publisher_.publish_transforms(transforms));
  robots_.publish(frame_->tick, time_step_);
  robots_.ask_efforts(client_);
  if (news) robots_.follow(client_, frame_->tick, time_step_);
  warn(publisher_.publish_clock(time_at(frame_->tick, time_step_)));
}

void Feed::introduce(const BodyFrame& frame) {
  std::vector<BodyId> strangers;
  for (const BodySample& body : frame.bodies) {
    if (!transforms_->has_name(body.id)) strangers.push_back(body.id);
  }
  if (strangers.empty()) return;
  warn(catalogue_.learn(strangers));
  for (const BodyId id : strangers) {
    if (const FoundBody* body = catalogue_.find(id)) transforms_->name(id, body->name);
  }
}

}  // namespace tessera::ros
