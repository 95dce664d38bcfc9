// The view of one tab: relative to the centre of a sector near the camera, so that numbers are small and the
// picture is sharp at any distance from the world's origin. The sector may be one of a frame that moves: the
// view goes along with it then, along its axes.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "client_sdk/live/body_catalogue.h"
#include "lpss/model/frame_motion.h"
#include "lpss/model/world_description.h"
#include "tessera/stream.h"
#include "viewer/frame_encoder.h"

namespace tessera::viewer {

// The visible volume: a cube of edge 2 `half` around `centre`.
struct Interest {
  WorldPosition centre;
  double half = 100;  // m

  friend bool operator==(const Interest&, const Interest&) = default;
};

// The same, in the world frame if it is in one that this world does not have, as after another was loaded.
Interest known_in(const WorldSettings& settings, Interest interest);

class PageView {
 public:
  PageView(const Interest& interest, const WorldSettings& settings)
      : interest_(interest), settings_(settings), carriers_(settings) {}

  const SectorIndex& sector() const { return interest_.centre.sector; }
  const Interest& interest() const { return interest_; }

  // Knows where carriers were in a view before, of the same world.
  void go_on_from(const PageView& before) { carriers_ = before.carriers_; }

  // Against gravity and what turning frames make of it, at the centre of the view; not against what speeds a
  // frame up, by which the picture would tilt. Where that is next to nothing, the z axis.
  Eigen::Vector3d up(Tick tick) const;

  // The centre of the planet if there is one, m from the centre of the sector.
  std::optional<Eigen::Vector3d> planet(Tick tick) const;

  // The sector that points are relative to, and its frame if that moves; the up direction there, and the
  // planet if there is one.
  nlohmann::json describe(Tick tick) const;

  // Before what is in the frames that they carry.
  void see_carriers(const BodyFrame& frame);

  // Of other frames than the view's, where they are at that tick.
  SeenBody see(const BodySample& body, std::uint8_t server, Tick tick) const;

  // Whether it is within the view.
  bool holds(const SeenBody& body) const;

  // Static bodies that extend into the view, ascending by id. The position of an infinite plane is its point
  // closest to the sector's centre.
  std::vector<SeenBody> see_statics(const live::BodyCatalogue& catalogue, Tick tick) const;

  // Whether what rests moves in the view: with a frame.
  bool has_frames() const { return !settings_.frames.empty(); }

  // The contacts within the view.
  std::vector<SeenContact> see(const ContactFrame& frame) const;

 private:
  Eigen::Vector3d offset(const WorldPosition& point) const;
  WorldPose posed(const WorldPose& pose, Tick tick) const;
  // m/s^2, along the axes of its frame, on what rests at a place there.
  Eigen::Vector3d pull(const WorldPosition& place, double time) const;

  Interest interest_;
  WorldSettings settings_;
  SeenCarriers carriers_;
};

}  // namespace tessera::viewer
