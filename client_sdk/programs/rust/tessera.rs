//! For authors of programs in Rust, as tessera/program.h is for those in C, which explains each function. Copy this file
//! beside the program (docs/programs.md).
#![allow(dead_code)]

/// Once, with a description as TESSERA_PROGRAM has it in C: its lines, each with its end.
#[macro_export]
macro_rules! tessera_program {
    ($text:expr) => {
        const TEXT: &[u8] = $text.as_bytes();
        #[link_section = "tessera"]
        #[used]
        static DESCRIPTION: [u8; TEXT.len()] = {
            let mut bytes = [0; TEXT.len()];
            let mut n = 0;
            while n < TEXT.len() {
                bytes[n] = TEXT[n];
                n += 1;
            }
            bytes
        };
    };
}

/// What an instance knows. Lengths are in m, angles in rad, times in s; vectors are along the world's axes, and positions
/// relative to the centre of the sector in which the body lives.
#[repr(C)]
#[derive(Default)]
pub struct Senses {
    pub tick: f64,
    pub dt: f64,
    pub body: f64,
    pub program: f64,
    pub asleep: f64,
    pub mass: f64,
    pub position: [f64; 3],
    pub orientation: [f64; 4],
    pub velocity: [f64; 3],
    pub angular_velocity: [f64; 3],
    pub gravity: [f64; 3],
    pub start: [f64; 3],
}

/// A part of the answer to a question.
#[repr(C)]
#[derive(Default)]
pub struct Finding {
    pub body: f64,
    pub motion: f64, // 0: static, 1: dynamic, 2: kinematic
    pub distance: f64,
    pub normal: [f64; 3],
    pub point: [f64; 3],
    pub velocity: [f64; 3],
    pub impulse: f64,
    pub position: [f64; 3],
    pub rotation: [f64; 9], // of its centre frame, by rows
}

/// A joint that was asked for. Of axes that it does not have, numbers are 0.
#[repr(C)]
#[derive(Default)]
pub struct JointFinding {
    pub joint: f64,
    pub kind: f64, // 0: fixed, 1: revolute, 2: prismatic, 3: ball, 4: universal, 5: screw
    pub parent: f64,
    pub child: f64,
    pub axes: f64,
    pub position: [f64; 2],
    pub rate: [f64; 2],
    pub lower: [f64; 2],
    pub upper: [f64; 2],
    pub effort: [f64; 2],
    pub drive: [f64; 2],
    pub target: [f64; 2],
    pub force: [f64; 3],
    pub torque: [f64; 3],
    pub gap: f64,
}

/// What drives an axis.
pub enum Drive {
    Free,
    Velocity(f64),
    Position(f64),
    Effort(f64),
    Servo { target: f64, stiffness: f64, damping: f64, velocity: f64, effort: f64 },
}

mod host {
    #[link(wasm_import_module = "tessera")]
    extern "C" {
        pub fn parameters(to: *mut f64);
        pub fn inputs(to: *mut f64);
        pub fn values(to: *mut f64);
        pub fn senses(to: *mut super::Senses);
        pub fn random(n: u32) -> f64;
        pub fn cast(
            from_x: f64,
            from_y: f64,
            from_z: f64,
            direction_x: f64,
            direction_y: f64,
            direction_z: f64,
            length: f64,
            radius: f64,
            mask: u32,
        );
        pub fn contacts(body: f64);
        pub fn inside(body: f64);
        pub fn body(body: f64);
        pub fn joints();
        pub fn joint(joint: f64);
        pub fn findings(question: i32) -> i32;
        pub fn finding(question: i32, n: i32, to: *mut super::Finding);
        pub fn joint_findings(question: i32) -> i32;
        pub fn joint_finding(question: i32, n: i32, to: *mut super::JointFinding);
        pub fn set_values(from: *const f64);
        pub fn push(x: f64, y: f64, z: f64, torque_x: f64, torque_y: f64, torque_z: f64);
        pub fn push_awake(x: f64, y: f64, z: f64, torque_x: f64, torque_y: f64, torque_z: f64);
        pub fn impulse(body: f64, x: f64, y: f64, z: f64, lever_x: f64, lever_y: f64, lever_z: f64);
        pub fn move_to(x: f64, y: f64, z: f64);
        pub fn tell(body: f64, program: i32, input: i32, value: f64);
        pub fn drive(
            joint: f64,
            axis: i32,
            mode: i32,
            target: f64,
            stiffness: f64,
            damping: f64,
            velocity: f64,
            effort: f64,
        );
        pub fn remove_joint(joint: f64);
        pub fn wake_in(ticks: i32);
    }
}

/// Its numbers, in the order of their lines; as many as it has.
pub fn parameters<const N: usize>() -> [f64; N] {
    let mut numbers = [0.0; N];
    unsafe { host::parameters(numbers.as_mut_ptr()) };
    numbers
}
pub fn inputs<const N: usize>() -> [f64; N] {
    let mut numbers = [0.0; N];
    unsafe { host::inputs(numbers.as_mut_ptr()) };
    numbers
}
pub fn values<const N: usize>() -> [f64; N] {
    let mut numbers = [0.0; N];
    unsafe { host::values(numbers.as_mut_ptr()) };
    numbers
}

pub fn senses() -> Senses {
    let mut senses = Senses::default();
    unsafe { host::senses(&mut senses) };
    senses
}
pub fn random(n: u32) -> f64 {
    unsafe { host::random(n) }
}

/// Questions, in ask().
pub fn cast(from: [f64; 3], direction: [f64; 3], length: f64, radius: f64, mask: u32) {
    let ([x, y, z], [along_x, along_y, along_z]) = (from, direction);
    unsafe { host::cast(x, y, z, along_x, along_y, along_z, length, radius, mask) }
}
pub fn contacts(body: f64) {
    unsafe { host::contacts(body) }
}
pub fn inside(body: f64) {
    unsafe { host::inside(body) }
}
pub fn body(body: f64) {
    unsafe { host::body(body) }
}
pub fn joints() {
    unsafe { host::joints() }
}
pub fn joint(joint: f64) {
    unsafe { host::joint(joint) }
}

/// Answers, in run(): that with a number, from 0.
pub fn findings(question: i32) -> i32 {
    unsafe { host::findings(question) }
}
pub fn finding(question: i32, n: i32) -> Finding {
    let mut finding = Finding::default();
    unsafe { host::finding(question, n, &mut finding) };
    finding
}

pub fn joint_findings(question: i32) -> i32 {
    unsafe { host::joint_findings(question) }
}
pub fn joint_finding(question: i32, n: i32) -> JointFinding {
    let mut finding = JointFinding::default();
    unsafe { host::joint_finding(question, n, &mut finding) };
    finding
}

/// Acts, in run().
pub fn set_values<const N: usize>(values: [f64; N]) {
    unsafe { host::set_values(values.as_ptr()) }
}
pub fn push(force: [f64; 3], torque: [f64; 3]) {
    unsafe { host::push(force[0], force[1], force[2], torque[0], torque[1], torque[2]) }
}
pub fn push_awake(force: [f64; 3], torque: [f64; 3]) {
    unsafe { host::push_awake(force[0], force[1], force[2], torque[0], torque[1], torque[2]) }
}
pub fn impulse(body: f64, impulse: [f64; 3], lever: [f64; 3]) {
    let ([x, y, z], [lever_x, lever_y, lever_z]) = (impulse, lever);
    unsafe { host::impulse(body, x, y, z, lever_x, lever_y, lever_z) }
}
pub fn move_to(position: [f64; 3]) {
    unsafe { host::move_to(position[0], position[1], position[2]) }
}
pub fn tell(body: f64, program: i32, input: i32, value: f64) {
    unsafe { host::tell(body, program, input, value) }
}
pub fn drive(joint: f64, axis: i32, drive: Drive) {
    let (mode, [target, stiffness, damping, velocity, effort]) = match drive {
        Drive::Free => (0, [0.0; 5]),
        Drive::Velocity(target) => (1, [target, 0.0, 0.0, 0.0, 0.0]),
        Drive::Position(target) => (2, [target, 0.0, 0.0, 0.0, 0.0]),
        Drive::Effort(target) => (3, [target, 0.0, 0.0, 0.0, 0.0]),
        Drive::Servo { target, stiffness, damping, velocity, effort } => {
            (4, [target, stiffness, damping, velocity, effort])
        }
    };
    unsafe { host::drive(joint, axis, mode, target, stiffness, damping, velocity, effort) }
}
pub fn remove_joint(joint: f64) {
    unsafe { host::remove_joint(joint) }
}
pub fn wake_in(ticks: i32) {
    unsafe { host::wake_in(ticks) }
}
