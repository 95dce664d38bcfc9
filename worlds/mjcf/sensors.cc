#include "worlds/mjcf/sensors.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>

#include <algorithm>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "lpss/base/utf8.h"
#include "lpss/model/limits.h"
#include "lpss/programs/registry.h"

namespace tessera::mjcf {
namespace {

// The name of a sensor's element.
const char* sensor_name(int type) {
  static const std::map<int, const char*> kNames = {
      {mjSENS_TOUCH, "touch"},
      {mjSENS_ACCELEROMETER, "accelerometer"},
      {mjSENS_VELOCIMETER, "velocimeter"},
      {mjSENS_GYRO, "gyro"},
      {mjSENS_FORCE, "force"},
      {mjSENS_TORQUE, "torque"},
      {mjSENS_MAGNETOMETER, "magnetometer"},
      {mjSENS_RANGEFINDER, "rangefinder"},
      {mjSENS_JOINTPOS, "jointpos"},
      {mjSENS_JOINTVEL, "jointvel"},
      {mjSENS_ACTUATORFRC, "actuatorfrc"},
      {mjSENS_FRAMEPOS, "framepos"},
      {mjSENS_FRAMEQUAT, "framequat"},
      {mjSENS_FRAMELINVEL, "framelinvel"},
      {mjSENS_FRAMEANGVEL, "frameangvel"},
      {mjSENS_SUBTREECOM, "subtreecom"},
  };
  const auto found = kNames.find(type);
  return found == kNames.end() ? "of another kind" : found->second;
}

// The kind of program that measures what a sensor does; null if none does.
const char* program_of(int type) {
  switch (type) {
    case mjSENS_ACCELEROMETER:
    case mjSENS_GYRO:
    case mjSENS_VELOCIMETER:
    case mjSENS_FRAMEQUAT:
      return "imu";
    case mjSENS_FORCE:
    case mjSENS_TORQUE:
      return "load";
    case mjSENS_RANGEFINDER:
      return "ranger";
    case mjSENS_TOUCH:
      return "touch";
    default:
      return nullptr;
  }
}

// Roll, pitch and yaw.
void set_turn(const Eigen::Quaterniond& rotation, ProgramRecord& record) {
  const Eigen::Vector3d angles = xml::angles_of(rotation);
  set_number(record, "roll", angles.x()).IgnoreError();
  set_number(record, "pitch", angles.y()).IgnoreError();
  set_number(record, "yaw", angles.z()).IgnoreError();
}

void set_position(const Eigen::Vector3d& position, ProgramRecord& record) {
  set_number(record, "x", position.x()).IgnoreError();
  set_number(record, "y", position.y()).IgnoreError();
  set_number(record, "z", position.z()).IgnoreError();
}

class SensorReader {
 public:
  SensorReader(const Model& model, const SensorBodies& bodies, WorldDescription& world, Notices& notices)
      : model_(model), bodies_(bodies), world_(world), notices_(notices) {}

  void read(int n) {
    const int type = model_->sensor_type[n];
    const char* const kind = program_of(type);
    const auto leave_out = [&](const char* why) {
      notices_.count(absl::StrCat("sensor ", sensor_name(type), why, ", skipped"));
    };
    if (kind == nullptr) return leave_out("");
    const std::optional<std::pair<int, Pose>> frame = frame_of(n);
    if (!frame) return leave_out(" of a geom or camera");
    if (model_->sensor_refid[n] >= 0) return leave_out(" relative to another frame");
    const auto place_in = static_cast<std::size_t>(frame->first);
    if (!bodies_.moves[place_in]) return leave_out(" on what never moves");
    const Place& place = bodies_.places[place_in];
    if (absl::string_view(kind) == "load" && place.joint == 0) return leave_out(" on a body without a joint");
    ProgramRecord* const record = program_at(n, kind, place, place.pose * frame->second);
    if (record == nullptr) return leave_out(" on a body that has its most programs already");
    set_noise(type, model_->sensor_noise[n], *record);
    notices_.count(absl::StrCat("sensor ", sensor_name(type), " is the program ", kind));
  }

 private:
  // MuJoCo's body that a sensor is on, and its frame there.
  std::optional<std::pair<int, Pose>> frame_of(int n) const {
    const int object = model_->sensor_objid[n];
    switch (model_->sensor_objtype[n]) {
      case mjOBJ_SITE:
        return std::pair{model_->site_bodyid[object], pose_at(model_->site_pos, model_->site_quat, object)};
      case mjOBJ_XBODY:
        return std::pair{object, Pose{}};
      case mjOBJ_BODY:
        return std::pair{object, pose_at(model_->body_ipos, model_->body_iquat, object)};
      default:
        return std::nullopt;
    }
  }

  std::string name_for(int n) const {
    std::string name;
    if (model_->sensor_objtype[n] == mjOBJ_SITE)
      name = name_at(*model_, model_->name_siteadr, model_->sensor_objid[n]);
    if (name.empty()) name = name_at(*model_, model_->name_sensoradr, n);
    if (name.size() > kProgramTextBytesMax || !is_utf8(name)) name.clear();
    return absl::StrReplaceAll(name, {{";", "_"}});
  }

  // Sensors of one frame that one program measures share it. Null if the body cannot have one more.
  ProgramRecord* program_at(int n, const char* kind, const Place& place, const Pose& pose) {
    BodyDescription& body = world_.bodies[place.body];
    const auto key = std::tuple{std::string(kind), model_->sensor_objtype[n], model_->sensor_objid[n]};
    const auto known = programs_.find(key);
    if (known != programs_.end()) return &body.programs[known->second];
    if (body.programs.size() >= kProgramsPerBodyMax) return nullptr;
    ProgramRecord record = new_program(kind).value();
    record.name = name_for(n);
    if (absl::string_view(kind) == "imu") {
      set_position(pose.position, record);
      set_turn(pose.orientation, record);
    } else if (absl::string_view(kind) == "load") {
      set_number(record, "joint", static_cast<double>(place.joint)).IgnoreError();
      set_number(record, "frame", 1).IgnoreError();
      set_number(record, "direction", -1).IgnoreError();
      set_turn(pose.orientation, record);
    } else if (absl::string_view(kind) == "ranger") {
      // Along the z axis of the site; a ranger looks along its x axis.
      constexpr double kHalf = std::numbers::sqrt2 / 2;
      const double cutoff = model_->sensor_cutoff[n];
      set_position(pose.position, record);
      set_turn((pose.orientation * Eigen::Quaterniond(kHalf, 0, -kHalf, 0)).normalized(), record);
      set_number(record, "most", cutoff > 0 ? std::min(cutoff, kProgramCastMax) : kProgramCastMax)
          .IgnoreError();
    }
    programs_.emplace(key, body.programs.size());
    return &body.programs.emplace_back(std::move(record));
  }

  static void set_noise(int type, double noise, ProgramRecord& record) {
    const char* const number = type == mjSENS_GYRO     ? "turn_noise"
                               : type == mjSENS_TORQUE ? "torque_noise"
                                                       : "noise";
    const bool is_measured = type != mjSENS_FRAMEQUAT && type != mjSENS_VELOCIMETER;
    if (is_measured && noise > 0) set_number(record, number, noise).IgnoreError();
  }

  const Model& model_;
  const SensorBodies& bodies_;
  WorldDescription& world_;
  Notices& notices_;
  std::map<std::tuple<std::string, int, int>, std::size_t> programs_;  // places on their bodies
};

}  // namespace

void add_sensors(const Model& model, const SensorBodies& bodies, WorldDescription& world, Notices& notices) {
  if ((model->opt.disableflags & mjDSBL_SENSOR) != 0) return;
  SensorReader reader(model, bodies, world, notices);
  for (int n = 0; n < model->nsensor; ++n) reader.read(n);
}

}  // namespace tessera::mjcf
