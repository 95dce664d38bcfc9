// What a client knows of a world whose requests it draws.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "lpss/grid/world_position.h"
#include "lpss/model/settings.h"
#include "query.pb.h"
#include "world.pb.h"

namespace tessera {

struct KnownWorld {
  struct Body {
    std::uint64_t id = 0;
    std::string name;
    v1::Motion motion = v1::MOTION_DYNAMIC;
  };
  struct Joint {
    std::uint64_t id = 0;
    std::string name;
    v1::JointType type = v1::JOINT_FIXED;
    std::uint64_t parent = 0;  // 0: the world
    std::uint64_t child = 0;
  };

  struct ProgramOf {
    std::uint64_t body = 0;
    std::uint32_t place = 0;  // on the body
    std::string kind;
  };

  WorldSettings settings;
  std::vector<WorldPosition> places;  // where something is, or was
  std::vector<Body> bodies;           // ascending by id
  std::vector<Joint> joints;          // likewise
  std::vector<ProgramOf> programs;    // ascending by body and place

  std::vector<std::uint64_t> bodies_that_are(v1::Motion motion) const {
    std::vector<std::uint64_t> ids;
    for (const Body& body : bodies) {
      if (body.motion == motion) ids.push_back(body.id);
    }
    return ids;
  }

  // All of it, as the cluster has answered.
  void learn(const v1::FoundBodies& found_bodies, const v1::FoundJoints& found_joints,
             const v1::FoundPrograms& found_programs) {
    bodies.clear();
    joints.clear();
    programs.clear();
    for (const auto& body : found_bodies.bodies())
      bodies.push_back({body.id(), body.name(), body.properties().motion()});
    for (const auto& joint : found_joints.joints()) {
      const v1::JointProperties& properties = joint.joint().properties();
      joints.push_back(
          {joint.id(), joint.joint().name(), properties.type(), properties.parent(), properties.child()});
    }
    for (const auto& program : found_programs.programs())
      programs.push_back({program.body(), program.program(), program.kind()});
  }
};

}  // namespace tessera
