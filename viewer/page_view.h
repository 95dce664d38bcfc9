// The view of one tab: relative to the centre of a sector near the camera, so that numbers are small and the
// picture is sharp at any distance from the world's origin.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
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

class PageView {
 public:
  PageView(const Interest& interest, const WorldSettings& settings)
      : interest_(interest), settings_(settings), carriers_(settings) {}

  const SectorIndex& sector() const { return interest_.centre.sector; }
  const Interest& interest() const { return interest_; }

  // Against gravity, at the centre of the view.
  Eigen::Vector3d up() const;

  // The sector that points are relative to, the up direction there, and the planet if there is one.
  nlohmann::json describe() const;

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

  Interest interest_;
  WorldSettings settings_;
  SeenCarriers carriers_;
};

}  // namespace tessera::viewer
