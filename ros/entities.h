// Models of a world as the entities of ROS's simulation_interfaces: found, told, placed, made and removed.
//
// An entity is a model ("robot"), or one body by its whole name ("robot::arm"). The state of a model is that
// of its first body.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tessera/client.h"

namespace tessera::ros {

// In the frame in which all is told: that of the centre of a sector, with the world's axes.
struct EntityState {
  Pose pose;                                                   // of the body frame
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          // m/s, of the centre of mass
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  // rad/s
};

// Of simulation_interfaces/EntityCategory, those that entities have here.
inline constexpr std::uint8_t kDynamicObject = 4;
inline constexpr std::uint8_t kStaticObject = 5;  // all of its bodies are static

// Which entities are asked for.
struct EntityFilter {
  std::string pattern;  // POSIX extended regular expression, at most kPatternBytesMax; empty: all
  struct Ball {
    Eigen::Vector3d centre{0, 0, 0};  // m
    double radius = 0;                // m, up to 4 sectors
  };
  std::optional<Ball> within;                        // those that overlap it
  std::optional<std::set<std::uint8_t>> categories;  // none: all
};
inline constexpr std::size_t kPatternBytesMax = 1024;

// For one thread. Errors are those of the client; FAILED_PRECONDITION while there is no world; NOT_FOUND for
// an entity that is not there; INVALID_ARGUMENT for a name, pose or pattern that is none.
class Entities {
 public:
  // `sector`: whose centre poses are relative to; none: that of the world's origin.
  Entities(Client& client, std::optional<SectorIndex> sector) : client_(client), sector_(sector) {}

  // Ascending by name.
  absl::StatusOr<std::vector<std::string>> names(const EntityFilter& filter);
  absl::StatusOr<std::vector<std::pair<std::string, EntityState>>> states(const EntityFilter& filter);
  absl::StatusOr<EntityState> state(const std::string& entity);
  absl::StatusOr<std::uint8_t> category(const std::string& entity);

  // Its bodies stay where they are relative to each other; what is not given stays as it is.
  absl::Status place(const std::string& entity, const std::optional<Pose>& pose,
                     const std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& velocities);

  // Adds a model under `name`, with its origin at `pose`. An empty name is that of the model. ALREADY_EXISTS
  // if that is taken, unless it may be `renamed`, with a number. Returns the name.
  absl::StatusOr<std::string> spawn(WorldDescription model, std::string name, bool renamed, const Pose& pose);
  absl::Status remove(const std::string& entity);

 private:
  struct Place {
    SectorIndex sector;
    double sector_size = 0;  // m
  };
  using Models = std::map<std::string, std::vector<FoundBody>>;

  absl::StatusOr<Place> place_of_frame();
  absl::StatusOr<Models> models();
  absl::StatusOr<std::vector<FoundBody>> bodies_of(const std::string& entity);
  absl::StatusOr<std::vector<BodySample>> samples_of(const std::vector<FoundBody>& bodies);

  Client& client_;
  const std::optional<SectorIndex> sector_;
};

}  // namespace tessera::ros
