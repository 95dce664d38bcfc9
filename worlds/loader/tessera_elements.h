// Tessera's own elements in SDF worlds, with the prefix `tessera:`.
// worlds/README.md says what each means, with defaults and bounds.
//
//   <tessera:settings> in <world>: <sector_size>, <precision>, <time_step>, <seams>, <clone_depth>,
//     <shuffle>, <solver_iterations>, <substeps>, <adapt>, <warm_starting>, <split_from>,
//     <friction_in_two_directions>, <continuous_collision>, <sleep_linear_speed>,
//     <sleep_angular_speed>, <sleep_after>: the knobs of WorldSettings.
//   <tessera:central_gravity surface= radius= [sector="i j k"] [local="x y z"]> in <world>.
//   <tessera:site name= latitude= longitude= [height=] [frame=]> in <world>: a frame on the globe, holding
//     <model>, <include> and <frame>.
//   <tessera:frame name= [velocity="x y z"] [spin="x y z"] [falls="true"] [loops="true"]> in <world>: a frame
//     that moves, holding <pose>, <tessera:region size="x y z" [centre="x y z"]/>, <tessera:leg seconds=
//     acceleration="x y z"/>, <tessera:key time= [velocity="x y z"] [spin="x y z"]> with a <pose>, <model>,
//     <include> and <frame>.
//   tessera:sector="i j k", attribute or element of <model>, <include> and <frame> of a world, site or
//     <tessera:frame>, and of that.
//   <tessera:velocity linear="x y z" angular="x y z"> in the same <model> and <include>.
//   <tessera:surface_motion [velocity="x y z"] [running="x y z"]/> in <link>.
//   <tessera:program kind= .../> in <link>: program_reader.h.
//   <tessera:drive mode= [target=] [axis=] [stiffness=] [damping=] [velocity=] [effort=]/> in <joint>.
//   <tessera:armature value= [axis=]/> in <joint>.
//   <tessera:heightfield columns= rows= spacing="x y">heights</tessera:heightfield> in <geometry>.
//   <tessera:ground source= spacing= [radius=] height= wavelength= [octaves=] [seed=] [sea=]/> in <geometry>.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <array>

#include "lpss/model/world_description.h"
#include "worlds/loader/xml.h"

namespace tessera {

absl::Status read_settings(const xml::Element& element, WorldSettings& settings);

absl::StatusOr<CentralGravity> read_central_gravity(const xml::Element& element, double sector_size);

absl::StatusOr<WorldPose> read_site(const xml::Element& element, double sector_size);

// A <tessera:frame>, which moves in the frame `parent`, and from which all but its models and frames is
// removed.
absl::StatusOr<MovingFrame> take_moving_frame(xml::Element& element, FrameNumber parent, double sector_size);

// Tessera's elements of a model, which are removed from it.
struct PlacementExtras {
  SectorOffset sector;
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
};
absl::StatusOr<PlacementExtras> take_extras(xml::Element& element);

// The drives of a <joint>, which are removed from it.
absl::StatusOr<JointDrives> take_drives(xml::Element& joint);

// Those of its axes (kg m^2 or kg), likewise.
absl::StatusOr<std::array<double, 2>> take_armatures(xml::Element& joint);

}  // namespace tessera
