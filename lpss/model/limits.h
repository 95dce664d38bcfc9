// Named limits, checked where data enters and again where it is used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "lpss/base/divergence_kind.h"  // kSpeedMax, kAngularSpeedMax

namespace tessera {

inline constexpr double kNoBound = std::numeric_limits<double>::infinity();

inline constexpr double kResolutionWanted = 1.0 / 8192;  // m: distance of neighbouring numbers, at most
inline constexpr double kSectorSizeMin = 0.5;            // m
inline constexpr double kTimeStepMin = 1e-5;             // s
inline constexpr double kTimeStepMax = 0.1;              // s
inline constexpr int kCloneDepthMax = 8;
inline constexpr int kSolverIterationsMax = 1000;
inline constexpr int kSubstepsMax = 64;
inline constexpr double kSplitFromMax = 1e6;  // m

inline constexpr double kMassMin = 1e-6;         // kg
inline constexpr double kMassMax = 1e6;          // kg; engines take heavier ones for immovable
inline constexpr double kExtentMin = 1e-4;       // m
inline constexpr double kStaticExtentMax = 1e8;  // m, of bounded static shapes
inline constexpr double kInertiaMin = 1e-18;     // kg m^2: smallest solid; less has no inverse in float
inline constexpr double kInertiaMax = 1e18;      // kg m^2
// The smallest principal moment of inertia, as a fraction of the largest: a rod 4,000 times as long as thick.
inline constexpr double kMomentRatioMin = 1e-7;
inline constexpr double kAccelerationMax = 1e6;           // m/s^2, of gravity
inline constexpr double kSurfaceSpeedMax = 1e3;           // m/s, of a belt
inline constexpr double kPatchRadiusMax = 1e3;            // m, of torsional friction
inline constexpr double kRollingFrictionMax = 1e3;        // m
inline constexpr double kImpulseMax = 1e12;               // N s
inline constexpr double kForceMax = 1e12;                 // N
inline constexpr double kTorqueMax = 1e12;                // N m
inline constexpr double kLeverMax = 1e8;                  // m, of an impulse
inline constexpr double kRadialSectorsMax = 4;            // edges of a sector, the radius of a radial impulse
inline constexpr double kDriveWayMax = 1e6;               // m, the target of a position drive
inline constexpr double kFrameSpeedMax = 3e8;             // m/s, of a frame that moves
inline constexpr double kFrameSpinMax = 1000;             // rad/s
inline constexpr double kRegionSizeMin = 1;               // m, of a frame that moves
inline constexpr double kAboardMax = 1e24;                // kg, kg m^2: of all that a body carries
inline constexpr double kFrameLegMax = 1e9;               // s; and the time of a key
inline constexpr double kFrameKeyReachMax = 1e12;         // m, of a key from where the frame starts
inline constexpr double kArmatureMax = 1e12;              // kg m^2, or kg: of the axis of a joint
inline constexpr double kGainMax = 1e12;                  // of a drive or spring: N/m, N s/m; N m and rad
inline constexpr double kMimicMultiplierMax = 1e6;        // rad/rad, m/m, m/rad or rad/m
inline constexpr double kFrameReachMax = 1e8;             // m, of a frame from its body
inline constexpr double kQuaternionNormTolerance = 1e-3;  // how far from 1 a unit quaternion may be

inline constexpr std::size_t kBodiesMax = 4'000'000;
inline constexpr std::size_t kJointsMax = 4'000'000;
// Of a body that may move: all of these joints push each other through it, so what they cost grows with the
// cube of their number.
inline constexpr std::size_t kJointsPerBodyMax = 128;
inline constexpr std::size_t kFramesMax = 4'000'000;
inline constexpr std::size_t kShapesMax = 1'000'000;
inline constexpr std::size_t kShapePartsMax = 4096;
inline constexpr std::size_t kHullPointsMax = 4096;
inline constexpr std::size_t kMeshVerticesMax = 20'000'000;
inline constexpr std::size_t kMeshIndicesMax = 60'000'000;
inline constexpr std::size_t kHeightFieldSamplesMax = 100'000'000;
// Ground. A sector's part of it has at most (3 kGroundCellsMax)^2 cells.
inline constexpr double kGroundReach = kStaticExtentMax;  // m, of a plain, from its origin along x and y
inline constexpr double kGroundSpacingMin = 0.01;         // m
inline constexpr double kGroundCellsMax = 64;             // spacings in the edge of a sector
inline constexpr double kGroundSpacingsMin = 8;           // spacings in the radius of a planet
inline constexpr double kPlainHeightMax = 1e6;            // m
inline constexpr double kPlanetHeightMax = 0.25;          // of its radius
inline constexpr std::uint32_t kGroundOctavesMax = 24;
inline constexpr std::size_t kPathBytesMax = 4096;
inline constexpr std::size_t kNameBytesMax = 1024;
inline constexpr std::size_t kUserDataBytesMax = 1024;  // a body

// Programs.
inline constexpr std::size_t kProgramsPerBodyMax = 8;
inline constexpr std::size_t kProgramNumbersMax = 256;    // parameters, inputs and values, of each
inline constexpr std::size_t kProgramAsksMax = 1024;      // a tick and instance
inline constexpr std::size_t kProgramActsMax = 1024;      // likewise
inline constexpr std::size_t kProgramFindingsMax = 1024;  // of one question
inline constexpr std::size_t kProgramTextBytesMax = 256;  // its kind, its name, or why it was stopped
inline constexpr double kProgramCastMax = 1e4;            // m
inline constexpr std::size_t kModulesMax = 16;            // a world

inline constexpr std::size_t kWorldFileBytesMax = 512u << 20;
inline constexpr int kXmlDepthMax = 64;
inline constexpr int kIncludeDepthMax = 16;

inline constexpr double kRayLengthMax = 1e6;  // m
inline constexpr std::size_t kRayGroundSectorsMax = 256;
inline constexpr std::size_t kRayHitsMax = 256;  // bodies, of a ray that passes through them
inline constexpr std::uint32_t kServersMax = 64;

}  // namespace tessera
