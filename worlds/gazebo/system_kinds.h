// Systems of Gazebo by what they do. Each of these gives links of a model programs, or joints drives, for one
// plugin.
#pragma once

#include "worlds/gazebo/system.h"

namespace tessera::gazebo {

// What moves on the ground.
void take_diff_drive(System& system);
void take_measured_drive(System& system);  // of Gazebo classic: it measures the wheels of its joints
void take_ackermann(System& system);
void take_velocity_control(System& system);
void take_planar_move(System& system);
void take_mecanum_drive(System& system);
void take_tracked_vehicle(System& system);
void take_track_controller(System& system);
void take_trajectory_follower(System& system);

// Joints.
void take_joint_position(System& system);
void take_joint_velocity(System& system);
void take_joint_trajectory(System& system);
void take_ros_control(System& system);
void take_mimic(System& system);

// What is measured.
void take_imu(System& system);
void take_pose(System& system);
void take_barometer(System& system);
void take_magnetometer(System& system);
void take_touch(System& system);
void take_performer_detector(System& system);

// What tells others, once something is so.
void take_triggered_publisher(System& system);

// What flies and swims.
void take_motor(System& system);
void take_multicopter(System& system);
void take_propeller(System& system);
void take_lift_drag(System& system);
void take_hydrodynamics(System& system);

}  // namespace tessera::gazebo
