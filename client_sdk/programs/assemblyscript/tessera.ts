// For authors of programs in AssemblyScript, as tessera/program.h is for those in C, which explains each function.
// Copy this file and describe.mjs beside the program (docs/programs.md).

// What an instance knows. Lengths are in m, angles in rad, times in s; vectors are along the world's axes, and
// positions relative to the centre of the sector in which the body lives.
@unmanaged export class Senses {
  tick: f64;
  dt: f64;
  body: f64;
  program: f64;
  asleep: f64;
  mass: f64;
  position_x: f64;
  position_y: f64;
  position_z: f64;
  orientation_x: f64;
  orientation_y: f64;
  orientation_z: f64;
  orientation_w: f64;
  velocity_x: f64;
  velocity_y: f64;
  velocity_z: f64;
  angular_velocity_x: f64;
  angular_velocity_y: f64;
  angular_velocity_z: f64;
  gravity_x: f64;
  gravity_y: f64;
  gravity_z: f64;
  start_x: f64;
  start_y: f64;
  start_z: f64;
}

// A part of the answer to a question.
@unmanaged export class Finding {
  body: f64;
  motion: f64; // 0: static, 1: dynamic, 2: kinematic
  distance: f64;
  normal_x: f64;
  normal_y: f64;
  normal_z: f64;
  point_x: f64;
  point_y: f64;
  point_z: f64;
  velocity_x: f64;
  velocity_y: f64;
  velocity_z: f64;
  impulse: f64;
  position_x: f64;
  position_y: f64;
  position_z: f64;
  rotation_0: f64; // of its centre frame, by rows
  rotation_1: f64;
  rotation_2: f64;
  rotation_3: f64;
  rotation_4: f64;
  rotation_5: f64;
  rotation_6: f64;
  rotation_7: f64;
  rotation_8: f64;
}

// A joint that was asked for. Of axes that it does not have, numbers are 0.
@unmanaged export class JointFinding {
  joint: f64;
  type: f64; // 0: fixed, 1: revolute, 2: prismatic, 3: ball, 4: universal, 5: screw
  parent: f64;
  child: f64;
  axes: f64;
  position_0: f64;
  position_1: f64;
  rate_0: f64;
  rate_1: f64;
  lower_0: f64;
  lower_1: f64;
  upper_0: f64;
  upper_1: f64;
  effort_0: f64;
  effort_1: f64;
  drive_0: f64;
  drive_1: f64;
  target_0: f64;
  target_1: f64;
  force_x: f64;
  force_y: f64;
  force_z: f64;
  torque_x: f64;
  torque_y: f64;
  torque_z: f64;
  gap: f64;
}

export const enum DriveMode {
  Free,
  Velocity,
  Position,
  Effort,
  Servo,
}

// Its numbers, in the order of their lines, at the place of an object that has them as fields.
@external("tessera", "parameters") export declare function parameters(to: usize): void;
@external("tessera", "inputs") export declare function inputs(to: usize): void;
@external("tessera", "values") export declare function values(to: usize): void;
@external("tessera", "senses") export declare function senses(to: Senses): void;
@external("tessera", "random") export declare function random(n: u32): f64;

// Questions, in ask().
@external("tessera", "cast")
export declare function cast(from_x: f64, from_y: f64, from_z: f64, direction_x: f64, direction_y: f64,
                             direction_z: f64, length: f64, radius: f64, mask: u32): void;
@external("tessera", "contacts") export declare function contacts(body: f64): void;
@external("tessera", "inside") export declare function inside(body: f64): void;
@external("tessera", "body") export declare function body(body: f64): void;
@external("tessera", "joints") export declare function joints(): void;
@external("tessera", "joint") export declare function joint(joint: f64): void;

// Answers, in run().
@external("tessera", "findings") export declare function findings(question: i32): i32;
@external("tessera", "finding") export declare function finding(question: i32, n: i32, to: Finding): void;
@external("tessera", "joint_findings") export declare function joint_findings(question: i32): i32;
@external("tessera", "joint_finding")
export declare function joint_finding(question: i32, n: i32, to: JointFinding): void;

// Acts, in run().
@external("tessera", "set_values") export declare function set_values(from: usize): void;
@external("tessera", "push")
export declare function push(x: f64, y: f64, z: f64, torque_x: f64, torque_y: f64, torque_z: f64): void;
@external("tessera", "push_awake")
export declare function push_awake(x: f64, y: f64, z: f64, torque_x: f64, torque_y: f64, torque_z: f64): void;
@external("tessera", "impulse")
export declare function impulse(body: f64, x: f64, y: f64, z: f64, lever_x: f64, lever_y: f64, lever_z: f64): void;
@external("tessera", "move_to") export declare function move_to(x: f64, y: f64, z: f64): void;
@external("tessera", "tell") export declare function tell(body: f64, program: i32, input: i32, value: f64): void;
@external("tessera", "drive")
export declare function drive(joint: f64, axis: i32, mode: i32, target: f64, stiffness: f64, damping: f64, velocity: f64,
                              effort: f64): void;
@external("tessera", "remove_joint") export declare function remove_joint(joint: f64): void;
@external("tessera", "wake_in") export declare function wake_in(ticks: i32): void;
