#include "cli/trajectory.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/str_split.h>
#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <utility>

#include "lpss/model/world_records.h"

namespace tessera::cli {
namespace {

constexpr char kHeader[] =
    "tick,time,body,sector_i,sector_j,sector_k,x,y,z,qx,qy,qz,qw,vx,vy,vz,wx,wy,wz,asleep";
constexpr std::size_t kTextBytesMax = std::size_t{1} << 20;  // written in one go

// A name with commas, quotes or line breaks is quoted, as RFC 4180 has it.
std::string cell_of(const std::string& name) {
  if (name.find_first_of(",\"\r\n") == std::string::npos) return name;
  return absl::StrCat("\"", absl::StrReplaceAll(name, {{"\"", "\"\""}}), "\"");
}

// The shortest decimals that are read back as the same number.
void append_number(std::string& text, double value) {
  std::array<char, 32> digits;
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  text.push_back(',');
  text.append(digits.data(), end);
}

template <typename Vector>
void append_all(std::string& text, const Vector& values) {
  for (const double value : values) append_number(text, value);
}

bool matches(const std::string& glob, const std::string& name) {
  return fnmatch(glob.c_str(), name.c_str(), 0) == 0;
}

absl::Status unwritable(const std::filesystem::path& file) {
  return absl::UnavailableError(
      absl::StrCat("--trajectory: cannot write \"", file.string(), "\": ", std::strerror(errno)));
}

absl::Status check_globs(const std::vector<std::string>& globs,
                         std::span<const Trajectory::Candidate> bodies) {
  for (const std::string& glob : globs) {
    const auto named_so = [&](const Trajectory::Candidate& body) { return matches(glob, body.name); };
    if (std::any_of(bodies.begin(), bodies.end(), named_so)) continue;
    std::string there_are = absl::StrCat("--bodies: \"", glob, "\" matches none of the ", bodies.size(),
                                         bodies.size() == 1 ? " body" : " bodies", " of the world");
    if (!bodies.empty()) absl::StrAppend(&there_are, ", of which the first is \"", bodies.front().name, "\"");
    return absl::InvalidArgumentError(there_are);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::vector<std::string>> parse_globs(const std::string& text) {
  std::vector<std::string> globs = absl::StrSplit(text, ',');
  if (std::find(globs.begin(), globs.end(), "") != globs.end()) {
    return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" has an empty name"));
  }
  return globs;
}

absl::StatusOr<std::unique_ptr<Trajectory>> Trajectory::open(const TrajectoryOptions& options,
                                                             std::span<const Candidate> bodies,
                                                             const WorldSettings& settings, Tick first) {
  if (absl::Status status = check_globs(options.bodies, bodies); !status.ok()) return status;
  std::unique_ptr<Trajectory> trajectory(new Trajectory());
  for (const Candidate& body : bodies) {
    const bool chosen = options.bodies.empty()
                            ? !body.is_static
                            : std::any_of(options.bodies.begin(), options.bodies.end(),
                                          [&](const std::string& glob) { return matches(glob, body.name); });
    if (!chosen) continue;
    trajectory->ids_.push_back(body.id);
    trajectory->names_.push_back(cell_of(body.name));
  }
  trajectory->file_ = options.file;
  trajectory->first_ = first;
  trajectory->every_ = options.every;
  trajectory->time_step_ = settings.time_step;
  trajectory->sector_size_ = settings.sector_size;
  for (const MovingFrame& frame : settings.frames) trajectory->frames_.push_back(cell_of(frame.name));
  trajectory->out_.open(options.file, std::ios::binary);
  if (!trajectory->out_) return unwritable(options.file);
  trajectory->text_ = absl::StrCat(kHeader, settings.frames.empty() ? "\n" : ",frame\n");
  return trajectory;
}

void Trajectory::add(Tick tick, const BodySample& body) {
  const auto place = std::lower_bound(ids_.begin(), ids_.end(), body.id);
  if (place == ids_.end() || *place != body.id) return;
  const SectorIndex& sector = body.pose.position.sector;
  absl::StrAppend(&text_, tick);
  append_number(text_, static_cast<double>(tick) * time_step_);
  absl::StrAppend(&text_, ",", names_[static_cast<std::size_t>(place - ids_.begin())], ",", sector.i, ",",
                  sector.j, ",", sector.k);
  append_all(text_, body.pose.position.local);
  append_all(text_, body.pose.orientation.coeffs());
  append_all(text_, body.linear_velocity);
  append_all(text_, body.angular_velocity);
  absl::StrAppend(&text_, body.asleep ? ",1" : ",0");
  if (!frames_.empty())
    absl::StrAppend(&text_, ",", sector.frame == kWorldFrame ? "" : frames_[sector.frame - 1]);
  text_ += '\n';
  if (text_.size() >= kTextBytesMax) flush();
}

void Trajectory::add(Tick tick, const BodyRecord& body) {
  BodySample sample;
  sample.id = body.id;
  sample.pose = body_pose(body, sector_size_);
  sample.linear_velocity = Eigen::Vector3d(body.state.linear_velocity.data());
  sample.angular_velocity = Eigen::Vector3d(body.state.angular_velocity.data());
  sample.asleep = body.state.activity == Activity::kAsleep;
  add(tick, sample);
}

void Trajectory::flush() {
  out_ << text_;
  text_.clear();
}

absl::Status Trajectory::finish() {
  flush();
  out_.close();
  return out_ ? absl::OkStatus() : unwritable(file_);
}

}  // namespace tessera::cli
