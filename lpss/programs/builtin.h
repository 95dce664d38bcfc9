// The programs that come with Tessera: one file each, with a namespace for what is its own.
#pragma once

#include <array>

#include "lpss/programs/program.h"

namespace tessera {

const Program& ackermann_program();
const Program& altimeter_program();
const Program& barometer_program();
const Program& belt_program();
const Program& breaker_program();
const Program& camera_program();
const Program& character_program();
const Program& diff_drive_program();
const Program& field_program();
const Program& floater_program();
const Program& hydrodynamics_program();
const Program& imu_program();
const Program& load_program();
const Program& logical_camera_program();
const Program& magnetometer_program();
const Program& motorcycle_program();
const Program& mover_program();
const Program& multicopter_program();
const Program& pad_program();
const Program& pid_program();
const Program& portal_program();
const Program& pose_program();
const Program& ranger_program();
const Program& relay_program();
const Program& satellite_program();
const Program& thruster_program();
const Program& touch_program();
const Program& tracks_program();
const Program& trajectory_program();
const Program& treads_program();
const Program& vehicle_program();
const Program& velocity_control_program();
const Program& wander_program();
const Program& waypoints_program();
const Program& wind_program();
const Program& wing_program();

// Ascending by kind.
inline std::array<const Program*, 36> builtin_programs() {
  return {
      &ackermann_program(),  &altimeter_program(),      &barometer_program(),     &belt_program(),
      &breaker_program(),    &camera_program(),         &character_program(),     &diff_drive_program(),
      &field_program(),      &floater_program(),        &hydrodynamics_program(), &imu_program(),
      &load_program(),       &logical_camera_program(), &magnetometer_program(),  &motorcycle_program(),
      &mover_program(),      &multicopter_program(),    &pad_program(),           &pid_program(),
      &portal_program(),     &pose_program(),           &ranger_program(),        &relay_program(),
      &satellite_program(),  &thruster_program(),       &touch_program(),         &tracks_program(),
      &trajectory_program(), &treads_program(),         &vehicle_program(),       &velocity_control_program(),
      &wander_program(),     &waypoints_program(),      &wind_program(),          &wing_program()};
}

}  // namespace tessera
