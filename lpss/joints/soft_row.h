// Springs, dampers and servos as rows: efforts that follow where an axis is and how fast.
//
// They are solved implicitly, so they are stable whatever their gains: a damper acts on the velocity v1 at
// the end of a step (error: first order in dt), a spring on
//
//   way - dt (alpha v1 + beta v0),
//
// the way left at its end as seen from the velocity v0 before. Where a step is short beside the period, alpha
// = -beta = 1/4: the average acceleration method of Newmark (1959), second order, which neither takes nor
// gives energy, for any stiffness. What a step cannot resolve would then ring forever; it goes over to alpha
// = 1, beta = 0, the implicit Euler method, which damps it.
#pragma once

#include <span>

#include "lpss/joints/joint_rows.h"

namespace tessera::joints {

// stiffness * way + damping * (wanted_rate - rate) + effort, along an axis at the start of a step. Units as
// for JointDrive.
struct SoftEffort {
  double stiffness = 0;
  double damping = 0;
  double way = 0;
  double rate = 0;
  double wanted_rate = 0;
  double effort = 0;
  double mobility = 0;  // velocity per impulse, of which the period follows: mobility_of()
};

// Sets the velocity and compliance of a row of a step of `dt` seconds. False if it would give way without any
// effort: where there is neither stiffness nor damping.
bool soften(const SoftEffort& effort, double dt, JointRow& row);

// The velocity along a row by a unit of impulse, of bodies that nothing else holds than the rows `held` of
// the same joint (kHeldRowsMax at most).
double mobility_of(const JointRow& row, std::span<const JointRow> held, const JointStep& step);

}  // namespace tessera::joints
