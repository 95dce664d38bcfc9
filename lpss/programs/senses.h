// What programs may ask of the world, and what they are told: in messages, too.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "lpss/grid/sector_index.h"
#include "lpss/model/body.h"
#include "lpss/model/joint.h"

namespace tessera {

// What a program asks of the world as it is at the end of a tick. Positions in m, in the world's axes.
struct ProgramAsk {
  enum Kind : std::uint8_t {
    kCast,      // what a ray, or a ball that moves along it, meets first
    kContacts,  // what touches `body`
    kInside,    // what is in the triggers of `body`
    kBody,      // the state of `body`
    kVisitors,  // which dynamic bodies are in the triggers of `body`; distances are from `origin`
    kVisitor,   // `body`, of which it is known that it is one of these
    kJoints,    // the joints of `body`
    kJoint,     // `joint`
  };
  std::uint8_t kind = kCast;
  BodyId body;         // asked about; a cast passes through it
  JointId joint;       // likewise
  SectorIndex sector;  // that positions are relative to the centre of
  std::array<double, 3> origin{};
  std::array<double, 3> direction{};  // of unit length
  double length = 0;
  double radius = 0;  // of the ball; 0: a ray
  std::uint32_t mask = 0xffffffff;
};

// A part of the answer to a question. What the kind of the question does not speak of is 0.
struct ProgramFinding {
  std::uint32_t ask = 0;  // its place among those of the instance; in a message, of the asker's
  BodyId body;
  Motion motion = Motion::kStatic;
  double distance = 0;               // m, of a cast: that it went; of a visitor
  std::array<double, 3> normal{};    // of a cast or contact: on `body`, pointing away from it
  std::array<double, 3> point{};     // m, of the hit or contact, from the centre of the asked sector
  std::array<double, 3> velocity{};  // m/s: of the place that was hit; otherwise of the centre of mass
  double impulse = 0;                // N s, of a contact, along the normal, in the last tick
  std::array<double, 3> position{};  // m, of the centre of mass, from the centre of the asked sector
  std::array<double, 9> rotation{};  // of its centre frame, by rows
  double mass = 0;                   // kg, of a dynamic body that was met or asked for, or that visits
  bool is_held = false;              // of a visitor: joints hold it, or hold others to it
};

// What the home of one of its bodies knows of a joint that was asked for; together they know all of it.
struct JointPart {
  std::uint32_t ask = 0;  // as of a finding
  JointId joint;
  std::optional<JointRecord> record;  // told by the home of its child
  std::optional<JointSide> parent;    // relative to the centre of the asked sector
  std::optional<JointSide> child;     // likewise
};

// A joint that was asked for. Its position and rates are those that clients are told.
struct SensedJoint {
  std::uint32_t ask = 0;
  JointRecord record;
  JointState state;
};

}  // namespace tessera
